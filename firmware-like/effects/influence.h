// Influence, the accumulator that all active effects add to, and the Conditions they depend on.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline::effects {

/// Changes to the declared arm; all entries are zero if no effect acts. Effects read the conditions
/// and *add* to their entries; the arm's equations (deflection/loaded_arm.h) read the sum. Stored
/// flat so that the derivatives form a matrix: column k of the tip's gradient belongs to entry k. T
/// is double or a dual number.
template <typename T>
class Influence {
 public:
  /// Joint entries come first: kind * kMaxJoints + joint.
  enum JointEntry {
    kTurn,        ///< deflection of the joint independent of its load [rad] or [m]
    kCompliance,  ///< added to the declared compliance [rad/(N m)]
    kHardening,   ///< s -= value tau^3 [rad/(N m)^3]
    kLoadGap,     ///< s += value sign(tau) [rad]
    kLoadShare,   ///< s += value |tau| [rad/(N m)]
    kTorque,      ///< torque that acts only through the joint's compliance [N m]
    kLengthA,     ///< added to a of the DH table [m]
    kOffsetD,     ///< added to d [m]
    kTwistAlpha,  ///< added to alpha [rad]
    kTwistBeta,   ///< rotation about y after the one about x, between parallel axes [rad]
    /// Compliance of the joint's support: tilt of the bearing of a revolute joint [rad/(N m)], or
    /// 1/(E I) of the extended beam of a prismatic joint [1/(N m^2)].
    kBearing,
    kLinkBending,  ///< bending of the link: L / (E I) [rad/(N m)]
    kLinkTorsion,  ///< torsion of the link: L / (G J) [rad/(N m)]
    kGuideTiltX,   ///< prismatic joint: half the play about the x axis of its frame [rad]
    kGuideTiltY,   ///< the same about (travel x x axis); see GuidePlay
    kJointEntries
  };
  enum Entry {
    kFirst = kJointEntries * model::kMaxJoints,
    kGravityTurnX = kFirst,  ///< rotation of gravity about the axes x, y of W [rad]
    kGravityTurnY,
    kPayloadMass,                       ///< added to the payload [kg]
    kPayloadCog,                        ///< 3: added to the centre of gravity in F [m]
    kBendRatio = kPayloadCog + 3,       ///< bending of the tool times (1 + value)
    kShear,                             ///< 1/kappa: the tip moves by value F L / (G A)
    kRootCompliance,                    ///< of the flange coupling [rad/(N m)]
    kPedestalCompliance,                ///< of the base [rad/(N m)]
    kBase,                              ///< 3: translation of the base in W [m]
    kBaseRollPitchYaw = kBase + 3,      ///< 3: added to the base's roll, pitch, yaw [rad]
    kBaseTilt = kBaseRollPitchYaw + 3,  ///< 2: rotations of the base about x and y of W [rad]
    kTip = kBaseTilt + 2,               ///< 3: translation of the tip in F [m]
    kScale = kTip + 3,                  ///< measured positions or ranges times (1 + value)
    kCameraScale,                       ///< the same relative to the measuring camera's position
    kCameraDepth,                       ///< the same along the camera's optical axis only
    kCameraRadial,                      ///< k1 of the lens minus the calibrated one
    kRangeZero,                         ///< added to a measured range [m]
    kRangeAnchor,                       ///< 3: translation of the range anchor in W [m]
    kSize = kRangeAnchor + 3
  };

  T& Joint(JointEntry entry, int joint) { return values_[entry * model::kMaxJoints + joint]; }
  const T& Joint(JointEntry entry, int joint) const {
    return values_[entry * model::kMaxJoints + joint];
  }
  T& operator[](int entry) { return values_[entry]; }
  const T& operator[](int entry) const { return values_[entry]; }
  /// Every entry times a factor.
  void Scale(const T& factor) { values_ *= factor; }
  auto Vector(Entry first) { return values_.template segment<3>(first); }
  auto Vector(Entry first) const { return values_.template segment<3>(first); }

 private:
  Eigen::Matrix<T, kSize, 1> values_ = Eigen::Matrix<T, kSize, 1>::Zero();
};

/// Value of an additional recorded column, in file units.
struct RecordedValue {
  std::string column;
  double value = 0;
};

/// Conditions at one instant, filled once per row. An empty vector or an absent value means that
/// the quantity was not recorded; effects that need it add nothing, and the diagnosis does not
/// consider them. Joint values are those of the drives (model::DrivePositions), because effects act
/// on these: the caller converts the reported values. They are equal unless axes are coupled.
struct Conditions {
  model::JointVector q;    ///< commanded [rad] or [m]
  model::JointVector qd;   ///< [rad/s]
  model::JointVector qdd;  ///< [rad/s^2]
  model::JointVector
      last_move;  ///< change of q since the previous row in execution order [rad] or [m]
  model::JointVector approach;  ///< sign of each joint's last nonzero move: -1, 0 (unknown), +1
  model::JointVector tau;       ///< measured joint torques [N m]
  double payload_kg = 0;
  std::optional<double> t_s;
  std::optional<double> temp_C;
  std::optional<double> row;           ///< row number in the file, from 1
  std::vector<RecordedValue> further;  ///< recorded columns without a predefined meaning

  // Declared by the cell and constant; see DeclaredConditions.
  std::shared_ptr<const model::Robot> robot;  ///< as declared; its base may be that of a session
  std::optional<double> reference_temperature_C;
  bool camera = false;      ///< the tip is measured by a camera with a declared pose in W
  std::string camera_name;  ///< cameras that measured the tip: "side", "side+rear"; empty: unnamed

  /// The reported joint values of which these are the drives'.
  model::JointVector Reported(const model::JointVector& of_drives) const;

  /// Value that a file column of that name would have, in file units: t_s, temp_C, payload_kg, row,
  /// a joint column (model/joint_columns.h), or one of `further`; nullopt if unknown. Does not
  /// allocate.
  std::optional<double> Signal(std::string_view column) const;
};

/// The drives' values of joint values as reported; empty if these are not recorded.
inline model::JointVector OfDrives(const model::Robot& robot, const model::JointVector& reported) {
  return reported.size() == robot.size() ? model::DrivePositions(robot.couplings, reported)
                                         : reported;
}

/// Relative speed of a joint in the last synchronised move, dq_i / max_j |dq_j|, in -1..1; zero if
/// nothing moved or the move is unknown.
double ShareOfMove(const Conditions& conditions, int joint);

/// Conditions with only the values declared by the cell filled in.
Conditions DeclaredConditions(const model::CellModel& cell);

}  // namespace plumbline::effects
