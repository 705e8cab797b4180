// Angles of a URDF that look like right angles rounded to a few decimals.
#pragma once

#include <optional>
#include <string>

#include "app/base/config/fault.h"
#include "app/measure/urdf/joint_chain.h"

namespace plumbline::measure {

/// The multiple of pi/2 that an angle [rad] stands for, if it is that multiple rounded or cut off
/// to the decimals with which it is written, two at least (3.1416, -1.57); nullopt otherwise.
std::optional<double> RoundedRightAngle(double angle);

/// A warning if the chain from base to tip has rounded right angles that move the tip: by how much
/// it would move over a number of postures if exact ones were meant. The chain keeps the angles as
/// written. nullopt if there are none, or if the tip moves by less than 1e-4 mm.
std::optional<config::Fault> RoundedAnglesNote(const UrdfFile& urdf, const std::string& file,
                                               const JointChain& chain, Rising rising);

}  // namespace plumbline::measure
