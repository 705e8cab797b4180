#include "app/diagnosis/joint_loads.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "app/diagnosis/thresholds.h"
#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::diagnosis {
namespace {

constexpr double kCountedShare = 0.1;  // of the largest load
constexpr double kLeastLoad = 1e-3;    // N m or N: below it, no joint yields measurably

/// Revolute and prismatic joints with a compliance and a known torque, 0-based.
std::set<int> YieldingJoints(const deflection::LoadedArm& arm, const Model& model) {
  std::set<int> joints;
  for (int joint = 0; joint < arm.size(); ++joint) {
    if (arm.compliance(joint) != 0) joints.insert(joint);
  }
  for (const std::vector<effects::ActiveEffect>* effects : {&arm.effects(), &model.effects}) {
    for (const effects::ActiveEffect& effect : *effects) {
      if (!effect.term.effect->traits().adds_compliance) continue;
      for (const effects::TermParameter& parameter : effect.term.parameters)
        joints.insert(parameter.joint);
    }
  }
  std::erase_if(joints, [&](int joint) { return !arm.loads().known(joint); });
  return joints;
}

/// Gravity torque of one joint at each pose, the largest of its visits.
using TorqueOfPose = std::map<ClusterIndex, double>;

/// The range of the torques; nullopt if enough poses load the joint in both directions.
std::optional<model::Interval> OneDirection(const TorqueOfPose& torques) {
  double largest = 0;
  for (const auto& [pose, tau] : torques) largest = std::max(largest, std::abs(tau));
  if (largest < kLeastLoad) return std::nullopt;
  const double least = kCountedShare * largest;
  double low = HUGE_VAL, high = -HUGE_VAL;
  int positive = 0, negative = 0;
  for (const auto& [pose, tau] : torques) {
    low = std::min(low, tau);
    high = std::max(high, tau);
    positive += tau >= least ? 1 : 0;
    negative += -tau >= least ? 1 : 0;
  }
  if (std::min(positive, negative) >= kMinPosesPerDirection) return std::nullopt;
  return positive > negative ? model::Interval{0, high} : model::Interval{low, 0};
}

}  // namespace

std::vector<model::JointLoad> JointLoadsOf(const FitProblem& problem, const Model& model) {
  const Dataset& data = problem.data;
  const deflection::LoadedArm arm(CellOf(data, model, SessionIndex(0)));
  const std::set<int> joints = YieldingJoints(arm, model);
  if (joints.empty()) return {};
  std::map<int, TorqueOfPose> torques;
  deflection::LoadedState state;
  for (const RowIndex row : data.row_indices()) {
    if (problem.weights[row] < kOutlierWeight || data.numbers[row].count == 0) continue;
    const effects::Conditions& moment = data.conditions[row];
    effects::Influence<double> influence = arm.EffectsAt(moment);
    effects::AddEffects(model.effects, moment, influence);
    if (!arm.AtCommanded(data.measured(row).q, data.payloads[row], &influence, moment.tau, state))
      continue;
    for (const int joint : joints) {
      double& tau = torques[joint][data.cluster_of[row]];
      if (std::abs(state.tau[joint]) > std::abs(tau)) tau = state.tau[joint];
    }
  }
  std::vector<model::JointLoad> loads;
  for (const auto& [joint, of_poses] : torques) {
    if (const auto range = OneDirection(of_poses)) loads.push_back({joint, *range});
  }
  return loads;
}

}  // namespace plumbline::diagnosis
