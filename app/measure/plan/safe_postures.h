// Postures at which a robot may be measured: limits, singularities, floor, the arm itself.
#pragma once

#include <string>
#include <vector>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {

/// Rules for a posture; lengths in m, angles in rad.
struct SafetyRules {
  double limit_margin = 0.035;  ///< distance from the joint limits [rad]; prismatic: 1/10 of it [m]
  double least_dexterity = 0.03;  ///< smallest to largest singular value of the scaled Jacobian
  double link_radius_m = 0;       ///< of the links as capsules; 0: a twentieth of the reach
  double floor_m = 0;             ///< lowest height of a link's axis above the base, in B
};

/// Checks postures and straight joint moves of one arm.
///
/// The links are capsules between the origins of successive DH frames, the tool is a capsule from
/// the flange to the tip. A posture is unsafe if a capsule beyond the first link comes below the
/// floor, if two that are not neighbours are closer than two radii, or if the tip crosses a plane
/// that the cell declares as an artefact. Objects that the cell does not declare are not known
/// here.
class PostureCheck {
 public:
  /// @param cell  must outlive this object
  PostureCheck(const model::CellModel& cell, const SafetyRules& rules);

  const deflection::LoadedArm& arm() const { return arm_; }
  /// Smallest to largest singular value of the tip's Jacobian, whose translations are divided by
  /// the reach; 0 in a singular posture. Arms with fewer than six joints: of as many values as
  /// joints.
  double Dexterity(const model::JointVector& q) const;
  bool IsSafe(const model::JointVector& q) const;
  /// True if every posture on the straight joint move is free of collisions.
  bool IsMoveFree(const model::JointVector& from, const model::JointVector& to) const;
  /// Uniform within the limits (less the margin), or within +-pi or +-1 m; `u` holds numbers in
  /// 0..1.
  model::JointVector FromUnit(const model::JointVector& u) const;
  /// Moves the tip onto a point by Gauss-Newton steps from q; false if it cannot or the posture is
  /// unsafe. Only the directions in `across` (columns, unit, in W) are corrected: three for a
  /// point, the normal of a plane.
  bool MoveTipTo(const Vec3& p_W, const Eigen::MatrixXd& across, model::JointVector& q) const;

 private:
  bool IsFree(const model::JointVector& q) const;

  const model::CellModel& cell_;
  deflection::LoadedArm arm_;
  SafetyRules rules_;
  double reach_m_;
};

}  // namespace plumbline::measure
