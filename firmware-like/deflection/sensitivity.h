// How the measured tip follows every influence on the arm: one gradient for all effects.
#pragma once

#include <bitset>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline {

/// Some of the influence's entries.
using InfluenceSet = std::bitset<Influence<double>::kSize>;

/// Predicted measurement of one moment and its derivatives.
struct Sensitivity {
  using Gradient = Eigen::Matrix<double, 3, Influence<double>::kSize>;

  Vec3 p_W = Vec3::Zero();  ///< the tip as the instrument reads it [m]
  /// d p_W / d influence, the sagged posture following; zero for joints that the arm lacks.
  Gradient dp = Gradient::Zero();
  /// How the tip turns, d (rotation vector in W [rad]) / d influence; means nothing
  /// where it was not asked for.
  Gradient dr = Gradient::Zero();
  LoadedStateOf<double> state;
};

/// Derivative of the tip of the arm commanded to q with respect to each influence x, at
/// `influence`. The posture solves theta = q + s(theta, x); by the implicit function theorem
///   dp/dx = p_x + p_theta (I - s_theta)^-1 s_x.
/// An effect's columns are dp times its own d(influence)/d(parameters), so that the cost of this
/// does not depend on how many effects are considered.
/// @param wanted     entries whose derivative is needed; those of the others are zero
/// @param with_turn  whether the turn's derivative is needed, too
/// @return           false where the posture does not settle
[[nodiscard]] bool SensitivityAt(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                                 const Influence<double>& influence,
                                 const JointVector& measured_tau, const InfluenceSet& wanted,
                                 Sensitivity& sensitivity, bool with_turn = false);

/// The same, of every entry.
[[nodiscard]] bool SensitivityAt(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                                 const Influence<double>& influence,
                                 const JointVector& measured_tau, Sensitivity& sensitivity);

}  // namespace plumbline
