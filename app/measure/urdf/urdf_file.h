// Reader of URDF files: links, joints and their poses as plain values.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "firmware-like/geometry/pose.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// A rigid body and, if the file has them, its mass and centre of mass in the link's frame [kg, m].
struct UrdfLink {
  std::string name;
  int line = 0;
  std::optional<double> mass_kg;
  Vec3 com = Vec3::Zero();
  std::vector<config::Fault> faults = {};  ///< they count where the link is used
};

/// A joint between two links. At position q the child's frame in the parent's is
///   X_parent_child = X_PJ * Rot(axis, q)        revolute, continuous
///   X_parent_child = X_PJ * Trans(q axis)       prismatic
///   X_PJ.R = Rz(yaw) Ry(pitch) Rx(roll)         [wiki.ros.org/urdf/XML/joint]
struct UrdfJoint {
  /// kUnknown is a type that a URDF does not have, such as "ball"; it is taken to move.
  enum class Type { kFixed, kRevolute, kContinuous, kPrismatic, kPlanar, kFloating, kUnknown };
  std::string name;
  int line = 0;
  Type type = Type::kFixed;
  std::string type_name;
  std::string parent, child;
  Pose X_PJ;
  Vec3 rpy = Vec3::Zero();                 ///< as written [rad]
  Vec3 axis = Vec3::UnitX();               ///< unit length, in the joint's frame
  std::optional<model::Interval> limits;   ///< [rad] or [m]
  std::string mimics;                      ///< name of the joint that this one follows; else empty
  double rising = 0;                       ///< of <calibration> [rad] or [m]
  std::vector<config::Fault> faults = {};  ///< they count where the joint is used

  bool Moves() const { return type != Type::kFixed; }
};

struct UrdfFile {
  std::string name;
  std::vector<UrdfLink> links;
  std::vector<UrdfJoint> joints;
};

/// Parses the text of a URDF file. Pure function; `file` is only the name used in faults.
///
/// Faults of the file as a whole: XML syntax, a document type declaration (so that no entity is
/// ever expanded), another root element, xacro, no links. Everything else is a fault of one link or
/// joint, is kept there, and matters only to a chain that uses it (see ChainFromUrdf()): numbers
/// that are not finite or out of range, axes that are not of unit length, names given twice, joints
/// of links that the file does not have, a second parent.
/// @param faults  receives the faults of the file as a whole
/// @return        the links and joints, or nullopt if it has one
std::optional<UrdfFile> UrdfFromText(std::string_view text, const std::string& file,
                                     config::FaultList& faults);

}  // namespace plumbline::measure
