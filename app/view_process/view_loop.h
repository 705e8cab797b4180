// The viewer's loop: newest state, newest picture, no queue.
#pragma once

#include <memory>
#include <string>

#include "app/view/shown.h"
#include "app/view_process/alarm_pictures.h"
#include "app/view_process/drawing.h"
#include "app/view_process/viewer.h"
#include "drivers/display/registry.h"

namespace plumbline {

/// Draws when there is something new and the screen is ready for it: a frame is on the screen one
/// refresh and the drawing after it was seen. While the screen is busy newer states take the place
/// of older ones; one that is nearer to the next than to its own coming is let pass for that.
/// Without a screen, pictures are drawn only for whoever asks (`shown`), and once a second for the
/// files of alarms.
class ViewLoop {
 public:
  ViewLoop(const std::string& config_file, ViewModel model, Shown& shown);

  /// One round, at most some 50 ms.
  void Round();
  void Reload();
  /// What the newest picture was drawn of; of the thread that calls Round().
  const ViewState& state() const { return viewer_.view().state; }
  /// When the newest picture was begun; of the same thread.
  double begun_s() const { return drawn_s_; }

 private:
  void OpenDisplay();
  void TakeState();
  bool on_screen() const;
  bool Due(double now_s) const;
  double PatienceForNext_s(double now_s) const;
  void DrawOne(ImageSize size, bool show);
  void TellDisplay(DisplayResult result);
  void TellShown(double now_s);

  Viewer viewer_;
  Drawing drawing_;
  std::unique_ptr<AlarmPictures> alarms_;
  Shown& shown_;
  std::unique_ptr<Display> display_;
  std::string display_problem_;  ///< empty: it shows pictures, or was not asked yet
  bool fresh_ = false;           ///< a state that was not drawn
  double drawn_s_ = -1e300, trimmed_s_ = 0;
  double told_s_ = -1e300;    ///< to whom looks from elsewhere
  double shared_s_ = -1e300;  ///< the last picture for them
};

/// For the process, before its threads: few arenas, and pictures in pages of their own, which go
/// back as soon as they are done with.
void KeepHeapSmall();

/// Runs until SIGTERM or SIGINT; SIGHUP reads the configuration again.
/// @return the process's exit code: 0 ended by signal, 1 faults in the configuration
int RunView(const std::string& config_file);

}  // namespace plumbline
