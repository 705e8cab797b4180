// Rigid bodies that carry tags, and the estimation of a body's pose from all its visible tags.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/tracking/tag_detector.h"
#include "app/tracking/tag_pose.h"

namespace plumbline::tracking {

/// Library whose picture of a tag was printed. OpenCV draws the AprilTag families rotated by half a
/// turn, so a tag's own top left depends on it.
enum class DrawnBy : std::uint8_t { kUnspecified, kAprilTag, kOpenCv };

/// A tag on a body K, with the pose of its frame M (see tag_pose.h).
struct BodyTag {
  int id = 0;
  double side_m = 0;  ///< of the black square
  Pose X_KM;
  DrawnBy drawn_by = DrawnBy::kUnspecified;
};

/// Typical standard deviation per axis of the positions of tags that were printed on one plate.
inline constexpr double kPlaceSdOnOnePlate_m = 2e-5;

/// A rigid body with tags: the cell, the gripper, a part.
struct Body {
  std::string name;
  std::vector<BodyTag> tags;
  /// Standard deviation of a tag's declared position, per axis; nullopt if not configured.
  std::optional<double> place_sd_m = {};
};

/// A tag that is not part of a body.
struct StandaloneTag {
  int id = 0;
  double side_m = 0;
  DrawnBy drawn_by = DrawnBy::kUnspecified;
};

/// The known tags of a cell. Each id occurs once, on a body or alone.
struct TagDatabase {
  std::vector<Body> bodies;
  std::vector<StandaloneTag> tags;
  std::optional<double> default_side_m;      ///< side of all tags that are not listed
  DrawnBy drawn_by = DrawnBy::kUnspecified;  ///< of all tags that are not listed

  std::optional<double> SideOf(int id) const;
  DrawnBy DrawnByOf(int id) const;
  const Body* BodyOf(int id) const;
};

/// A located body.
struct SeenBody {
  const Body* body = nullptr;
  PoseEstimate estimate;   ///< X_CK
  bool ambiguous = false;  ///< another pose fits its tags equally well
  std::vector<int> used;   ///< ids
  std::vector<int>
      left_out;  ///< ids of tags that contradict the others: moved, or declared wrongly
};

/// Estimates one pose from all visible tags of a body, starting from the two poses of each of its
/// largest tags and from `previous`, if given. As long as some tag's corners are off by more than
/// half a pixel, more than six of their standard deviations and more than four times the body's
/// place_sd_m, the tag without which the others agree best is excluded, provided that two remain.
/// If several tags are wrong, removing one at a time may remove the right ones; the poses of all
/// pairs of tags are therefore tried as well, and the one that most tags agree with is used. An id
/// detected twice in the image is not used.
/// @return  nullopt if none of its tags is visible, or no pose fits
std::optional<SeenBody> LocateBody(const lens::KnownLens& lens, const Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous);

}  // namespace plumbline::tracking
