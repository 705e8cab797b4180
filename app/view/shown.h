// What others in this process may look at: how things are now and, where somebody asks, the
// picture.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "app/view/status_text.h"
#include "drivers/display/picture.h"

namespace plumbline {

/// What the screen says at one moment, as values, and the state that it is said of.
struct ShownNow {
  double time_s = 0;                       ///< monotonic, when it was put together
  std::shared_ptr<const ViewState> state;  ///< the newest; null: none came yet
  std::string link_problem;                ///< why no states come; empty: they do
  std::string picture_problem;             ///< why nothing is drawn; empty: it is
  PanelLine headline;
  CellHealth health;  ///< that the headline shows
  std::vector<Panel> panels;
  std::vector<ViewLine> own_lines;         ///< of the viewer's own log
  std::map<int, std::string> point_names;  ///< by id; of points that have one
  std::vector<JointType> joints;           ///< of the model that is shown; empty: none
  std::vector<MeasuredPair> pairs;         ///< empty: nothing was measured of late
  std::vector<double> frames_per_s;        ///< of each camera, as they arrived
};

/// With the state of a silent daemon withdrawn: `now` may be older than the moment it is shown at,
/// where the drawing thread hangs.
ShownNow AsShownAt(const ShownNow& now, double now_s);

/// Copies what `facts` point to.
ShownNow ShownOf(const ViewFacts& facts, std::string picture_problem);

struct ShownPicture {
  RgbImage image;
  double time_s = 0;  ///< monotonic, when it was drawn
};

/// Between the drawing thread, which puts, and others, which look. Nobody waits for more than a
/// copied pointer.
class Shown {
 public:
  static constexpr double kAskedFor_s = 3;

  void Put(std::shared_ptr<const ShownNow> now);
  void Put(std::shared_ptr<const ShownPicture> picture);

  /// Null: none yet.
  std::shared_ptr<const ShownNow> Now() const;
  std::shared_ptr<const ShownPicture> picture() const;
  /// The same, and asks for pictures for the next kAskedFor_s as well.
  std::shared_ptr<const ShownPicture> AskPicture(double now_s);
  bool Asked(double now_s) const;

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const ShownNow> now_;
  std::shared_ptr<const ShownPicture> picture_;
  double asked_s_ = -1e300;
};

}  // namespace plumbline
