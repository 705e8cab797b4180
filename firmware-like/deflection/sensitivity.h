// Gradient of the measured tip with respect to every entry of Influence, shared by all effects.
#pragma once

#include <bitset>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::deflection {

/// A subset of the entries of Influence.
using InfluenceSet = std::bitset<effects::Influence<double>::kSize>;

/// Predicted measurement and its derivatives.
struct Sensitivity {
  using Gradient = Eigen::Matrix<double, 3, effects::Influence<double>::kSize>;

  Vec3 p_W = Vec3::Zero();  ///< tip position reported by the instrument [m]
  /// d p_W / d influence, including the change of the deflected posture; zero for joints that the
  /// arm does not have.
  Gradient dp = Gradient::Zero();
  /// d (rotation vector of the tip in W [rad]) / d influence; meaningless unless requested.
  Gradient dr = Gradient::Zero();
  LoadedStateOf<double> state;
};

/// Derivative of the tip of the arm commanded to q with respect to each influence entry x, at
/// `influence`. The posture solves theta = q + s(theta, x), so by the implicit function theorem
///   dp/dx = p_x + p_theta (I - s_theta)^-1 s_x.
/// The columns of an effect are dp times its own d(influence)/d(parameters); the cost of this
/// function therefore does not depend on the number of effects considered.
/// @param wanted     entries whose derivative is required; the columns of the others are zero
/// @param with_turn  also compute dr
/// @return           false if the posture does not converge
[[nodiscard]] bool SensitivityAt(const LoadedArm& arm, const model::JointVector& q,
                                 const loads::Payload& payload,
                                 const effects::Influence<double>& influence,
                                 const model::JointVector& measured_tau, const InfluenceSet& wanted,
                                 Sensitivity& sensitivity, bool with_turn = false);

/// The same for every entry.
[[nodiscard]] bool SensitivityAt(const LoadedArm& arm, const model::JointVector& q,
                                 const loads::Payload& payload,
                                 const effects::Influence<double>& influence,
                                 const model::JointVector& measured_tau, Sensitivity& sensitivity);

}  // namespace plumbline::deflection
