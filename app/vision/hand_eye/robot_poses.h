// Table of robot poses, one per image.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "app/vision/hand_eye/hand_eye.h"

namespace plumbline::vision {

/// One row: the flange in B, or the joints.
struct RobotPose {
  Pose X_BF;
  model::JointVector q;  ///< empty if the table contains poses
};

/// Reads a CSV with a header: `image`, a file name, and either x_mm, y_mm, z_mm, qw, qx, qy, qz
/// (flange in base) or q1_deg .. qn_deg (q<i>_mm for a prismatic joint). Other columns are ignored.
/// An invalid row, or an image listed twice, is a fault with its line.
/// @param joints  of the cell; empty without a cell, in which case only poses can be read
/// @return        by image; nullopt if there is a fault
std::optional<std::map<std::string, RobotPose>> RobotPosesFromCsv(
    std::string_view text, const std::string& file, const std::vector<model::Joint>& joints,
    config::FaultList& faults);

}  // namespace plumbline::vision
