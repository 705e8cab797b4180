// Reader of a Universal Robots calibration, `default_kinematics.yaml` of the ROS description.
#pragma once

#include "app/measure/urdf/joint_chain.h"

namespace plumbline::measure {

/// How the keys roll, pitch, yaw are to be read.
enum class UrAngles {
  kRollPitchYaw,  ///< R = Rz(yaw) Ry(pitch) Rx(roll), as the ROS description reads them
  kXyz,           ///< R = Rx(roll) Ry(pitch) Rz(yaw), as ur_calibration computed them from the
                  ///< controller's DH table, which this gives back exactly
};

/// True if the text looks like such a file rather than like XML.
bool IsUrKinematics(std::string_view text);

/// Parses `kinematics: {shoulder, upper_arm, forearm, wrist_1, wrist_2, wrist_3: {x, y, z, roll,
/// pitch, yaw}}` in metres and radians, each the origin of one joint that turns about its z axis.
/// Pure function. The base is the controller's frame "base"; the tip is "tool0", which coincides
/// with the frame of wrist_3. The file has neither limits nor masses.
/// @param faults  receives faults, each with the key and its line
std::optional<JointChain> ChainFromUrKinematics(std::string_view text, const std::string& file,
                                                UrAngles angles, config::FaultList& faults);

}  // namespace plumbline::measure
