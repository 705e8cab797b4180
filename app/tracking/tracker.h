// Tags and bodies from frame to frame.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/tracking/bodies.h"
#include "app/tracking/tag_detector.h"

namespace plumbline {

/// A tag of one frame, with its pose where its size and the lens are known.
struct TrackedTag {
  SeenTag seen;
  double side_m = 0;                     ///< 0: not known
  std::optional<PoseEstimate> estimate;  ///< X_CM
  bool ambiguous = false;                ///< the corners allow another pose, and nothing decides
};

struct TrackedFrame {
  std::vector<TrackedTag> tags;
  std::vector<SeenBody> bodies;
  bool whole_frame = false;  ///< the whole image was searched, not only around predicted tags
  bool limited = false;      ///< see SeenTags
};

struct TrackerSettings {
  DetectorSettings detector = {};
  int whole_every = 15;     ///< frames from one search of the whole image to the next
  double remember_s = 0.5;  ///< for so long a pose decides between two
};

/// Follows tags. Where a tag is expected it is looked for around there: its last corners moved on
/// at their last velocity, in a box larger by half its size and by what it moved. The whole image
/// is searched at the start, every `whole_every` frames, and once in the frame in which a tag that
/// was expected is not found. Not for several threads.
///
/// Where corners allow two poses (PosePair::ambiguous), the body's pose decides, else the pose
/// just before: flips are suppressed. A tag's pose just before that was itself undecided leaves
/// it ambiguous.
class Tracker {
 public:
  Tracker(TagFamily family, TagDatabase database, const TrackerSettings& settings);

  /// @param time_s  when the image was taken, monotonic
  /// @param lens    null while it is not known: corners only
  /// @return        valid until the next call
  const TrackedFrame& Update(const LumaView& image, double time_s, const KnownLens* lens);

  /// Forgets every prediction: after a cut, or when the camera returns.
  void Forget();

  const TagDatabase& database() const { return database_; }

 private:
  /// A tag of the last frames.
  struct Track {
    int id = 0;
    Corners corners;
    Corners velocity;  ///< [px/s], zero after one frame
    double time_s = 0;
  };
  struct Remembered {
    Pose X;
    bool ambiguous = false;
    double time_s = 0;
  };

  Corners Predicted(const Track& track, double time_s) const;
  bool SearchPredicted(const LumaView& image, double time_s, const Lens* lens);
  void UpdateTracks(double time_s);
  void Locate(double time_s, const KnownLens& lens);
  void LocateTag(TrackedTag& tag, double time_s, const KnownLens& lens);

  TagDatabase database_;
  TrackerSettings settings_;
  TagDetector detector_;
  SeenTags seen_;
  TrackedFrame frame_;
  std::vector<Track> tracks_;
  std::vector<TagDetector::Part> parts_;
  std::map<int, Remembered> last_tag_;
  std::map<std::string, Remembered> last_body_;
  int frames_since_whole_ = 0;
};

}  // namespace plumbline
