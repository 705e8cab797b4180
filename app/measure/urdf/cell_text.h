// Writer of a cell file for imported kinematics.
#pragma once

#include <string>

#include "app/measure/urdf/joint_chain.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// Text of a cell.toml with the robot's table and a rigid tool of no length; numbers with 1e-9 mm
/// and 1e-10 degrees.
/// @param chain   names the joints in comments
/// @param source  file that the robot was imported from, for the comment at the top
std::string CellText(const model::Robot& robot, const JointChain& chain, const std::string& source);

}  // namespace plumbline::measure
