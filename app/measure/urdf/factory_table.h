// Reader of a factory table: the calibrated joint frames of one arm in YAML.
#pragma once

#include "app/measure/urdf/joint_chain.h"

namespace plumbline::measure {

/// How the keys roll, pitch, yaw are to be read.
enum class TableAngles {
  kRollPitchYaw,  ///< R = Rz(yaw) Ry(pitch) Rx(roll), as ROS descriptions read them
  kXyz,           ///< R = Rx(roll) Ry(pitch) Rz(yaw), as ur_calibration computed them from the
                  ///< controller's DH table, which this gives back exactly
};

/// True if the text looks like such a file rather than like XML.
bool IsFactoryTable(std::string_view text);

/// Parses a table of joint frames, one block each of `x, y, z, roll, pitch, yaw` in metres and
/// radians, side by side under any keys: the origin of one joint in the previous one's frame; the
/// joint turns about its z axis. Pure function.
/// A Universal Robots `default_kinematics.yaml` (shoulder .. wrist_3, from the controller's frame
/// "base" to "tool0") and an xArm's `joint1` .. `joint7` are such tables. Blocks whose names end in
/// numbers are ordered by them; others stand in the order of the chain. The file has neither limits
/// nor masses, and may contain keys beside the blocks, such as a hash.
/// @param faults  receives faults, at most one per block
std::optional<JointChain> ChainFromFactoryTable(std::string_view text, const std::string& file,
                                                TableAngles angles, config::FaultList& faults);

}  // namespace plumbline::measure
