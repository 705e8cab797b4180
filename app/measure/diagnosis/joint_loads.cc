#include "app/measure/diagnosis/joint_loads.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "app/measure/diagnosis/thresholds.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;

/// How one joint yields over the fitted rows.
struct JointInRows {
  std::map<ClusterIndex, double> torques;  ///< of each pose, the largest of its visits
  /// Largest over the rows: displacement of the tip per unit of torque, and by a gap [m].
  double per_torque_m = 0, by_gap_m = 0;
};

/// The torque that moves the tip by the noise; 0 if a gap alone does.
double LeastTorque(const JointInRows& joint, double sigma_m) {
  if (joint.by_gap_m >= sigma_m) return 0;
  return joint.per_torque_m > 0 ? sigma_m / joint.per_torque_m : HUGE_VAL;
}

/// The range of the torques; nullopt if enough poses load the joint in both directions, or if none
/// moves the tip by the noise.
std::optional<model::Interval> OneDirection(const JointInRows& joint, double sigma_m) {
  constexpr double kCountedShare = 0.1;   // of the largest torque
  constexpr double kRoundedShare = 1e-3;  // of the largest torque: a balanced joint
  constexpr double kLeastLoad = 1e-3;     // N m or N: below it, a torque is a rounding error
  double low = 0, high = 0;
  for (const auto& [pose, tau] : joint.torques) {
    low = std::min(low, tau);
    high = std::max(high, tau);
  }
  const double largest = std::max(-low, high);
  const double least = std::max(LeastTorque(joint, sigma_m), kRoundedShare * largest);
  if (!(largest > std::max(least, kLeastLoad))) return std::nullopt;
  const double counted = std::max(least, kCountedShare * largest);
  int positive = 0, negative = 0;
  for (const auto& [pose, tau] : joint.torques) {
    positive += tau >= counted ? 1 : 0;
    negative += -tau >= counted ? 1 : 0;
  }
  const bool shown = positive >= kMinPosesPerDirection;
  const bool reverse_shown = negative >= kMinPosesPerDirection;
  if (shown && reverse_shown) return std::nullopt;
  model::Interval range{std::min(low, -least), std::max(high, least)};
  if (shown) range.low = -least;
  if (reverse_shown) range.high = least;
  return range;
}

/// Adds what one row shows of every joint.
void AddRow(const deflection::LoadedArm& arm, const I& influence,
            const deflection::LoadedState& state, ClusterIndex pose,
            std::vector<JointInRows>& joints) {
  kinematics::Jacobian jacobian;
  arm.chain().JacobianAt(state.posture, state.X_BT.p, jacobian);
  for (int i = 0; i < arm.size(); ++i) {
    if (!arm.loads().known(i)) continue;
    JointInRows& joint = joints[static_cast<std::size_t>(i)];
    const double tau = state.tau[i], lever = jacobian.col(i).head<3>().norm();
    const double slope = arm.compliance(i) + influence.Joint(I::kCompliance, i) -
                         influence.Joint(I::kHardening, i) * tau * tau;
    joint.per_torque_m = std::max(joint.per_torque_m, std::abs(slope) * lever);
    joint.by_gap_m = std::max(joint.by_gap_m, std::abs(influence.Joint(I::kLoadGap, i)) * lever);
    double& largest = joint.torques[pose];
    if (std::abs(tau) > std::abs(largest)) largest = tau;
  }
}

}  // namespace

std::vector<model::JointLoad> JointLoadsOf(const FitProblem& problem, const Model& model,
                                           const std::set<int>& suspected) {
  const Dataset& data = problem.data;
  Indexed<SessionIndex, deflection::LoadedArm> arms;  // gravity in the base depends on its frame
  for (const SessionIndex session : data.sessions.indices())
    arms.emplace_back(CellOf(data, model, session));
  std::vector<JointInRows> joints(static_cast<std::size_t>(arms.front().size()));
  for (const int joint : suspected) joints[static_cast<std::size_t>(joint)].by_gap_m = HUGE_VAL;
  deflection::LoadedState state;
  for (const RowIndex row : data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight || data.numbers[row].count == 0) continue;
    const deflection::LoadedArm& arm = arms[data.session_of[row]];
    const effects::Conditions& moment = data.conditions[row];
    I influence = arm.EffectsAt(moment);
    effects::AddEffects(model.effects, moment, influence);
    if (!arm.AtCommanded(data.measured(row).q, data.payloads[row], &influence, moment.tau, state))
      continue;
    state.X_BT = arm.X_WB().Inverse() * state.X_WT;
    AddRow(arm, influence, state, data.cluster_of[row], joints);
  }
  std::vector<model::JointLoad> loads;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (const auto range = OneDirection(joints[i], problem.sigma_m))
      loads.push_back({static_cast<int>(i), *range});
  }
  return loads;
}

}  // namespace plumbline::measure
