// Output of a hand-eye calibration: JSON file and readable text.
#pragma once

#include <string>

#include "app/vision/hand_eye/hand_eye.h"

namespace plumbline::vision {

/// HANDEYE.json: schema, accepted, reasons, setup; `camera` and `target`, each with its parent
/// frame, xyz_mm, rpy_deg, quaternion_wxyz and the covariance of (x, y, z, rotation about its own
/// axes) in mm and rad; other estimated parameters, the estimated noise, the error on held-out
/// images, images used and refused. Poses are null if there is no solution.
/// @param X_WB  declared pose of the robot's base; adds `measurement`, the camera in W as in a cell
///              file (camera in the cell only). Null without a cell.
std::string HandEyeJson(const HandEye& result, const HandEyeOptions& options, const Pose* X_WB);

std::string HandEyeText(const HandEye& result, const HandEyeOptions& options);

}  // namespace plumbline::vision
