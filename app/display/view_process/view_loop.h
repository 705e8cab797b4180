// Main loop of the display process: draws the newest state, without a queue.
#pragma once

#include <memory>
#include <string>

#include "app/display/view/display_mailbox.h"
#include "app/display/view_process/alarm_pictures.h"
#include "app/display/view_process/drawing.h"
#include "app/display/view_process/viewer.h"
#include "drivers/display/registry.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::display {

/// Draws when there is a new state and the display is ready, so that an image is visible one
/// drawing and one refresh after it was taken. While the display is busy, newer states replace
/// older ones; a state closer to the next frame than to its own arrival is skipped in favour of the
/// next. A picture that would equal the last one is not drawn again, so that a still cell costs
/// little. Without a display, pictures are drawn on request (DisplayMailbox::RequestPicture) and
/// once a second for the alarm pictures.
class ViewLoop {
 public:
  ViewLoop(const std::string& config_file, cell::ViewModel model, display::DisplayMailbox& shown);

  /// One iteration, at most about 50 ms.
  void RunOnce();
  /// Reads the configuration again and reopens the display.
  void Reload();
  /// State of the newest picture. Call from the thread that calls RunOnce().
  const cell::ViewState& state() const { return viewer_.view().state; }
  /// When drawing the newest picture started. Call from the same thread.
  double drawing_started_s() const { return drawn_s_; }

 private:
  void OpenDisplay();
  void HandleState();
  bool on_screen() const;
  bool Due(double now_s) const;
  double WaitForNextFrame_s(double now_s) const;
  void DrawOne(image::ImageSize size, bool show);
  void LogDisplayState(display::DisplayResult result);
  void PublishStatus(double now_s);

  Viewer viewer_;
  Drawing drawing_;
  std::unique_ptr<AlarmPictures> alarms_;
  display::DisplayMailbox& shown_;
  std::unique_ptr<display::Display> display_;
  std::string display_problem_;  ///< empty if it shows pictures, or was not used yet
  bool fresh_ = false;           ///< there is a state that has not been drawn
  /// What was done with the newest picture: on the display, shared with the page, kept for an
  /// alarm.
  bool on_display_ = false, shared_ = false, kept_ = false;
  double rendered_s_ = -1e300;
  double drawn_s_ = -1e300, trimmed_s_ = 0;
  double status_s_ = -1e300;  ///< when the status was last published
  double shared_s_ = -1e300;  ///< when a picture was last published
};

/// Configures malloc for the process: few arenas, and pictures in mappings of their own that are
/// returned when freed. Call before threads are started.
void ConfigureMalloc();

/// Runs until SIGTERM or SIGINT; SIGHUP reloads the configuration.
/// @param port_file  receives the page's port whenever it is served; empty: none
/// @return  the exit code: 0 stopped by a signal, 1 faults in the configuration
int RunView(const std::string& config_file, const std::string& port_file = "");

}  // namespace plumbline::display
