// Tags, and rigid bodies that carry tags, as declared for a cell.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/geometry/pose.h"

namespace plumbline::target {

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

}  // namespace plumbline::target
