// The answer of a hand-eye calibration as a file.
#pragma once

#include <string>

#include "app/hand_eye/hand_eye.h"

namespace plumbline {

/// HANDEYE.json: schema, accepted, reasons, setup; `camera` and `target`, each the frame that it
/// stands in, xyz_mm, rpy_deg, quaternion_wxyz and the covariance of (x, y, z, turn about its own
/// axes) in mm and rad; what was adjusted with them, the noise found, the error on images that took
/// no part, images used and refused. Poses are null where none was found.
/// @param X_WB  where the robot's base is declared; adds `measurement`, the camera in W as a cell
///              file has it (of a camera in the cell only); null where no cell was given
std::string HandEyeJson(const HandEye& answer, const HandEyeOptions& options, const Pose* X_WB);

/// The same for people.
std::string HandEyeText(const HandEye& answer, const HandEyeOptions& options);

}  // namespace plumbline
