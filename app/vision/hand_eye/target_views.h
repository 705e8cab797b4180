// Detection of the calibration target in a folder of images, combined with the robot's poses.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/hand_eye/robot_poses.h"
#include "app/vision/tracking/bodies.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/known_lens.h"

namespace plumbline::vision {

/// The target: a board or a body of tags.
struct Target {
  target::Board board;
  const target::Body* body = nullptr;  ///< null for the board
  target::TagFamily family;            ///< of the body's tags
};

struct TargetViews {
  std::vector<HandEyeView> views;
  std::vector<RefusedView> refused;
};

/// Detects the target in each image that has a robot pose. Refused, with their names: images
/// without a pose, poses without an image, images of another size than the lens, and images without
/// a detected target.
/// @param interrupted  called before each image; true ends the search early
TargetViews FindTargets(const std::string& folder, const std::vector<std::string>& names,
                        const std::map<std::string, RobotPose>& poses, const Target& target,
                        const lens::KnownLens& lens, const std::function<bool()>& interrupted);

}  // namespace plumbline::vision
