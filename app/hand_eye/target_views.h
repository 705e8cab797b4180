// The target in a folder of images, with the robot's poses.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/hand_eye/robot_poses.h"
#include "app/lens/board.h"
#include "app/tracking/bodies.h"

namespace plumbline {

/// What the robot carries, or what stands before its camera: a chessboard, or a body of tags.
struct Target {
  Board board;
  const Body* body = nullptr;  ///< null: the board
  TagFamily family;            ///< of the body's tags
};

/// Images with their target, and those without one.
struct TargetViews {
  std::vector<HandEyeView> views;
  std::vector<RefusedView> refused;
};

/// Looks for the target in each image that has a robot pose. Refused, by name, are images without a
/// pose, poses without an image, images of another size than the lens, and those that show no
/// target.
/// @param interrupted  asked before each image; true ends the search early
TargetViews FindTargets(const std::string& folder, const std::vector<std::string>& names,
                        const std::map<std::string, RobotPose>& poses, const Target& target,
                        const Lens& lens, ImageSize size, const std::function<bool()>& interrupted);

}  // namespace plumbline
