// Mailbox from the drawing thread to the page's threads: the display's status as values and, on
// request, the picture.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/display/view/panels.h"
#include "app/display/view/point_tiles.h"
#include "app/display/view/state_strip.h"
#include "drivers/display/picture.h"

namespace plumbline::display {

/// Content of the display at one instant, as values, with the state it was derived from.
struct DisplayStatus {
  double time_s = 0;                             ///< when it was compiled, monotonic
  std::shared_ptr<const cell::ViewState> state;  ///< the newest; null if none was received yet
  std::string link_problem;                      ///< why no states arrive; empty if they do
  std::string picture_problem;                   ///< why nothing is drawn, or empty
  StateStrip strip;
  PanelLine headline;  ///< the strip as one line
  std::string remedy;  ///< what to do about the health; empty: nothing
  std::vector<PointTile> tiles;
  CellHealth health;  ///< as the headline shows it
  std::vector<Panel> panels;
  std::vector<cell::ViewLine> viewer_lines;  ///< the viewer's own log
  std::map<int, std::string> point_names;    ///< by point id; named points only
  std::vector<model::JointType> joints;      ///< of the displayed model; empty without one
  std::vector<cell::MeasuredPair> pairs;     ///< empty without a recent measurement
  std::vector<double> frames_per_s;          ///< received frame rate of each camera
};

/// Withdraws the state if the daemon has become silent since `now` was compiled, which may be long
/// ago if the drawing thread hangs.
DisplayStatus WithdrawIfSilent(const DisplayStatus& now, double now_s);

/// Copies everything that `facts` refers to.
DisplayStatus MakeDisplayStatus(const ViewFacts& facts, std::string picture_problem);

struct DisplayPicture {
  display::RgbImage image;
  double time_s = 0;  ///< when it was drawn, monotonic
};

/// Written by the drawing thread, read by any thread. A caller waits for no more than the copy of a
/// pointer.
class DisplayMailbox {
 public:
  static constexpr double kPictureRequestLifetime_s = 3;

  void Publish(std::shared_ptr<const DisplayStatus> status);
  void Publish(std::shared_ptr<const DisplayPicture> picture);
  /// The published picture is still what would be drawn.
  void ConfirmPicture(double now_s);

  /// Null until the first was published.
  std::shared_ptr<const DisplayStatus> status() const;
  std::shared_ptr<const DisplayPicture> picture() const;
  /// Until when the picture was current, monotonic.
  double picture_current_s() const;
  /// Returns picture() and requests pictures for the next kPictureRequestLifetime_s.
  std::shared_ptr<const DisplayPicture> RequestPicture(double now_s);
  bool PictureRequested(double now_s) const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const DisplayStatus> status_;
  std::shared_ptr<const DisplayPicture> picture_;
  double current_s_ = -1e300, requested_s_ = -1e300;
};

}  // namespace plumbline::display
