// Where the robot stood at each image: a table.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "app/config/fault.h"
#include "app/hand_eye/hand_eye.h"

namespace plumbline {

/// One row: the flange in B, or the joints.
struct RobotPose {
  Pose X_BF;
  JointVector q;  ///< empty where the table holds poses
};

/// Reads a CSV with a header: `image`, a file name, and either x_mm, y_mm, z_mm, qw, qx, qy, qz
/// (the flange in the base) or q1_deg .. qn_deg (q<i>_mm of a prismatic joint). Other columns are
/// left alone. A row that cannot be read, and an image that stands twice, are faults with their
/// line.
/// @param joints  of the cell; empty where none was given: then only poses can be read
/// @return        by image; nothing where there is a fault
std::optional<std::map<std::string, RobotPose>> RobotPosesFromCsv(std::string_view text,
                                                                  const std::string& file,
                                                                  const std::vector<Joint>& joints,
                                                                  FaultList& faults);

}  // namespace plumbline
