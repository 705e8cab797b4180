// Tracker of tags and bodies over a sequence of frames.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/vision/tracking/bodies.h"
#include "app/vision/tracking/tag_detector.h"

namespace plumbline::vision {

/// A tag of one frame, with its pose if its size and the lens are known.
struct TrackedTag {
  SeenTag seen;
  double side_m = 0;                     ///< 0: unknown
  std::optional<PoseEstimate> estimate;  ///< X_CM
  bool ambiguous = false;                ///< another pose fits as well and nothing decides
};

struct TrackedFrame {
  std::vector<TrackedTag> tags;
  std::vector<SeenBody> bodies;
  bool full_search = false;  ///< the whole image was searched, not only predicted regions
  bool limited = false;      ///< see SeenTags
};

struct TrackerSettings {
  DetectorSettings detector = {};
  int full_search_interval = 15;  ///< frames between two searches of the whole image
  double pose_memory_s = 0.5;     ///< how long a past pose resolves an ambiguity
};

/// Whether all corners of a tag lie where the lens is trusted. Others are detected and tracked, but
/// have no pose and do not contribute to that of a body.
bool InUsableRegion(const lens::KnownLens& lens, const SeenTag& tag);

/// Searches each known tag only around its predicted position: its last corners, extrapolated at
/// their last velocity, in a box enlarged by half its size and by its motion. The whole image is
/// searched at the start, every `full_search_interval` frames, and in any frame in which an
/// expected tag is not found. Not thread-safe.
///
/// If the corners allow two poses (PosePair::ambiguous), the body's pose decides, otherwise the
/// previous pose of the tag, which suppresses flips. If that pose was itself ambiguous, the tag
/// remains so.
class Tracker {
 public:
  Tracker(target::TagFamily family, target::TagDatabase database, const TrackerSettings& settings);

  /// @param time_s  when the image was taken, monotonic
  /// @param lens    null if unknown: only corners are measured
  /// @return        valid until the next call
  const TrackedFrame& Update(const image::LumaView& image, double time_s,
                             const lens::KnownLens* lens);

  /// Whether tags whose `drawn_by` is unspecified are read as OpenCV draws them; initially they are
  /// read as the AprilTag library draws them. Without effect on ArUco families.
  void AssumeOpenCvPrints(bool assume) { opencv_prints_ = assume; }
  /// Tags that do not contribute to the pose of their body.
  void SetAside(std::vector<int> ids) { set_aside_ = std::move(ids); }

  /// Discards all predictions: after a cut in a recording, or when the camera reconnects.
  void Forget();

  const target::TagDatabase& database() const { return database_; }

 private:
  /// A tag that is being followed.
  struct Track {
    int id = 0;
    Corners corners;
    Corners velocity;  ///< [px/s], zero after one frame
    double time_s = 0;
  };
  struct PastPose {
    Pose X;
    bool ambiguous = false;
    double time_s = 0;
  };

  Corners Predicted(const Track& track, double time_s) const;
  bool SearchPredicted(const image::LumaView& image, double time_s, const lens::Lens* lens);
  void ApplyPrintOrigins();
  void UpdateTracks(double time_s);
  void Locate(double time_s, const lens::KnownLens& lens);
  void LocateTag(TrackedTag& tag, double time_s, const lens::KnownLens& lens);

  target::TagDatabase database_;
  TrackerSettings settings_;
  TagDetector detector_;
  bool opencv_prints_ = false;
  std::vector<int> set_aside_;
  SeenTags seen_;
  TrackedFrame frame_;
  std::vector<Track> tracks_;
  std::vector<TagDetector::Part> parts_;
  std::map<int, PastPose> last_tag_;
  std::map<std::string, PastPose> last_body_;
  int frames_since_full_search_ = 0;
};

}  // namespace plumbline::vision
