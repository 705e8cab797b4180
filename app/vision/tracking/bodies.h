// Estimation of a body's pose from all its visible tags.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/base/target/tags.h"
#include "app/vision/tracking/tag_detector.h"
#include "app/vision/tracking/tag_pose.h"

namespace plumbline::vision {

/// A located body.
struct SeenBody {
  const target::Body* body = nullptr;
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
std::optional<SeenBody> LocateBody(const lens::KnownLens& lens, const target::Body& body,
                                   const std::vector<SeenTag>& tags,
                                   const std::optional<Pose>& previous);

}  // namespace plumbline::vision
