// Resolution and convention of the tool pose in a robot profile.
#pragma once

#include "app/measure/controller/controller_sample.h"
#include "drivers/robot/profile.h"

namespace plumbline::measure {

/// Sets the steps and the orientation's convention of a sample that is read by a profile. Joint
/// steps are those of the readings (model::RobotState::q_resolution).
void StepsOf(const robot::RobotProfile& profile, ControllerSample& sample);

}  // namespace plumbline::measure
