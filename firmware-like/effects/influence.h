// What the active effects do to the arm in one moment: the accumulator that every effect adds to.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// One value a joint, of a number type T.
template <typename T>
using JointVectorOf = Eigen::Matrix<T, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

/// Changes to the declared arm, all zero where nothing acts. An effect reads the moment's
/// conditions and *adds* to the entries it means; the arm's equations (deflection/loaded_arm.h)
/// read the sum. Stored flat, so that its derivatives are a matrix: column k of the tip's gradient
/// belongs to entry k here. T is double, or a number that carries its derivatives.
template <typename T>
class Influence {
 public:
  /// Joint entries come first: kind * kMaxJoints + joint.
  enum JointEntry {
    kTurn,        ///< rotation of the joint, whatever its load [rad] (or [m])
    kCompliance,  ///< added to the declared compliance [rad/(N m)]
    kHardening,   ///< s -= value tau^3 [rad/(N m)^3]
    kLoadGap,     ///< s += value sign(tau) [rad]
    kLoadShare,   ///< s += value |tau|, whichever way the load pulls [rad/(N m)]
    kTorque,      ///< acts only through the joint's compliance [N m]
    kLengthA,     ///< added to a of the DH table [m]
    kOffsetD,     ///< added to d [m]
    kTwistAlpha,  ///< added to alpha [rad]
    kTwistBeta,   ///< turn about y after that about x, of axes that are parallel [rad]
    /// What carries the joint yields to the weight outboard of it: of a turning joint its bearing
    /// tilts [rad/(N m)], of a sliding one its beam bends where it is extended [1/(N m^2)].
    kBearing,
    kLinkBending,  ///< the link bends: L / (E I) [rad/(N m)]
    kLinkTorsion,  ///< and twists: L / (G J) [rad/(N m)]
    kGuideTiltX,   ///< of a prismatic joint: half the play about the x axis of its frame [rad]
    kGuideTiltY,   ///< and about the travel x x; see guide_play.h
    kJointEntries
  };
  enum Entry {
    kFirst = kJointEntries * kMaxJoints,
    kGravityTurnX = kFirst,  ///< gravity turns about the measurement axes x, y [rad]
    kGravityTurnY,
    kPayloadMass,                       ///< added to the payload [kg]
    kPayloadCog,                        ///< 3: added to its centre of gravity in F [m]
    kBendRatio = kPayloadCog + 3,       ///< bending of the tool times (1 + value)
    kShear,                             ///< 1/kappa: the tip moves by value F L / (G A)
    kRootCompliance,                    ///< of the flange coupling [rad/(N m)]
    kPedestalCompliance,                ///< of the base [rad/(N m)]
    kBase,                              ///< 3: the base moves in W [m]
    kBaseRollPitchYaw = kBase + 3,      ///< 3: added to the base's roll, pitch, yaw [rad]
    kBaseTilt = kBaseRollPitchYaw + 3,  ///< 2: turns of the base about W's x and y [rad]
    kTip = kBaseTilt + 2,               ///< 3: the tip moves in F [m]
    kScale = kTip + 3,                  ///< measured positions or ranges times (1 + value)
    kCameraScale,                       ///< the same from the measuring camera's place
    kCameraDepth,                       ///< along its optical axis only
    kCameraRadial,                      ///< k1 of the lens that its calibration lacks
    kRangeZero,                         ///< added to a measured range [m]
    kRangeAnchor,                       ///< 3: the anchor of the ranges moves in W [m]
    kSize = kRangeAnchor + 3
  };

  T& Joint(JointEntry entry, int joint) { return values_[entry * kMaxJoints + joint]; }
  const T& Joint(JointEntry entry, int joint) const { return values_[entry * kMaxJoints + joint]; }
  T& operator[](int entry) { return values_[entry]; }
  const T& operator[](int entry) const { return values_[entry]; }
  /// Every entry times a factor.
  void Scale(const T& factor) { values_ *= factor; }
  auto Vector(Entry first) { return values_.template segment<3>(first); }
  auto Vector(Entry first) const { return values_.template segment<3>(first); }

 private:
  Eigen::Matrix<T, kSize, 1> values_ = Eigen::Matrix<T, kSize, 1>::Zero();
};

/// A further recorded column in one moment, as the file has it.
struct RecordedValue {
  std::string column;
  double value = 0;
};

/// What is known of one moment beside the joint positions; filled once a row. An empty vector, or
/// an absent value, was not recorded: an effect that needs it adds nothing, and the diagnosis does
/// not offer it.
struct Conditions {
  JointVector q;          ///< as commanded [rad] or [m]
  JointVector qd;         ///< [rad/s]
  JointVector qdd;        ///< [rad/s^2]
  JointVector last_move;  ///< change of q from the row before in execution order [rad]
  JointVector approach;   ///< sign of each joint's last move that was not zero: -1, 0 (unknown), +1
  JointVector tau;        ///< measured joint torques [N m]
  double payload_kg = 0;
  std::optional<double> t_s;
  std::optional<double> temp_C;
  std::optional<double> row;           ///< place in the file's order, the first row being 1
  std::vector<RecordedValue> further;  ///< recorded columns without a meaning of their own

  // Declared, the same in every moment; see DeclaredConditions.
  std::shared_ptr<const Robot> robot;  ///< as declared; its base may be that of a session
  std::optional<double> reference_temperature_C;
  bool camera = false;  ///< a camera measures, and its pose in W is declared

  /// What a file's column of that name would hold in this moment, in its unit: t_s, temp_C,
  /// payload_kg, row, a joint's (model/joint_columns.h), or one of `further`; nothing where it is
  /// not known. Allocates nothing.
  std::optional<double> Signal(std::string_view column) const;
};

/// Joint i's share of the last synchronised move, dq_i / max_j |dq_j| in -1..1; zero where nothing
/// moved or the move is not known.
double ShareOfMove(const Conditions& conditions, int joint);

/// Conditions with what the cell declares filled in and nothing known of the moment.
Conditions DeclaredConditions(const CellModel& cell);

}  // namespace plumbline
