// Bodies that carry tags, and their poses from all the tags of each that are seen.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/tracking/tag_detector.h"
#include "app/tracking/tag_pose.h"

namespace plumbline {

/// A tag on a body K: where its frame M is (see tag_pose.h).
struct BodyTag {
  int id = 0;
  double side_m = 0;  ///< of the black square
  Pose X_KM;
};

/// How well places of tags are known that were printed on one plate, a deviation along an axis.
inline constexpr double kPlaceSdOnOnePlate_m = 2e-5;

/// The cell, the gripper, a part: whatever carries tags and is rigid.
struct Body {
  std::string name;
  std::vector<BodyTag> tags;
  std::optional<double> place_sd_m = {};  ///< of a tag's declared place, an axis; nothing: not told
};

/// A tag of its own.
struct LoneTag {
  int id = 0;
  double side_m = 0;
};

/// What is known of the tags of a cell. An id stands once, on a body or alone.
struct TagDatabase {
  std::vector<Body> bodies;
  std::vector<LoneTag> tags;
  std::optional<double> other_side_m;  ///< of every tag that is not listed

  std::optional<double> SideOf(int id) const;
  const Body* BodyOf(int id) const;
};

/// Where a body is.
struct SeenBody {
  const Body* body = nullptr;
  PoseEstimate estimate;      ///< X_CK
  bool ambiguous = false;     ///< another pose fits its tags as well
  std::vector<int> used;      ///< ids
  std::vector<int> left_out;  ///< ids whose corners contradict the others: moved, or wrongly listed
};

/// One pose for all tags of a body that are seen. It starts from the two poses of its largest tags
/// and from `previous`, if there is one. While a tag's corners lie more than half a pixel, six of
/// their deviations and four of the body's place_sd_m off, the one without which the others agree
/// best is left out, as long as two remain. A tag that is seen twice in the image is not used.
/// @return  nothing where none of its tags is seen, or no pose fits
std::optional<SeenBody> LocateBody(const KnownLens& lens, const Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous);

}  // namespace plumbline
