// The serial chain of moving joints between two links of a URDF.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/urdf/urdf_file.h"

namespace plumbline::measure {

/// A moving joint with everything that is rigidly attached to its child link, sensors and side
/// branches of fixed joints included.
struct ChainJoint {
  std::string name;
  std::string child;  ///< link that the joint moves
  model::JointType type = model::JointType::kRevolute;
  Pose X_prev;                ///< joint frame in that of the previous joint (first: base), at q = 0
  Vec3 axis = Vec3::UnitZ();  ///< unit length, in the joint's frame
  std::optional<model::Interval> limits;  ///< [rad] or [m]; absent if it has none
  std::optional<double> mass_kg;          ///< absent if no link attached here has a mass
  Vec3 com = Vec3::Zero();                ///< of that mass, in the joint's frame [m]
  double rising = 0;  ///< offset of the reading, contained in X_prev [rad] or [m]
};

/// What becomes of the reference positions (<calibration rising>) of the joints. robot_calibration
/// writes its joint offsets there: they are added to the reading.
enum class Rising { kIgnored, kAddedToReading };

struct JointChain {
  std::string name;  ///< of the robot
  std::string base, tip;
  std::vector<ChainJoint> joints;
  Pose X_last_tip;  ///< tip link in the frame of the last joint
};

/// The chain from `base` to `tip`. An empty tip is "tool0" (REP 199) if the file has it, else the
/// only end of the longest chain; an empty base is the root link above the tip.
///
/// Faults: those of the links and joints of the chain and of everything fixed to it, an unknown or
/// ambiguous end, a chain in a ring, a joint of a type that a serial arm cannot have (planar,
/// floating), a joint that mimics another, limits in the wrong order, no or more than kMaxJoints
/// moving joints. Warnings: faults of anything else, a joint without limits, a reference position
/// that is ignored, masses on moving joints outside the chain, which are left out.
std::optional<JointChain> ChainFromUrdf(const UrdfFile& urdf, const std::string& file,
                                        const std::string& base, const std::string& tip,
                                        Rising rising, config::FaultList& faults);

/// The motion of a joint by `position` [rad] or [m] about or along a unit vector.
Pose JointMotion(model::JointType type, const Vec3& axis, double position);

/// The joints from base to tip, fixed ones included; empty if there is no path.
std::vector<const UrdfJoint*> PathOf(const UrdfFile& urdf, const std::string& base,
                                     const std::string& tip);

/// Pose of the tip link in the base link at joint positions q [rad] or [m], shape (joints).
Pose TipPose(const JointChain& chain, const model::JointVector& q);

}  // namespace plumbline::measure
