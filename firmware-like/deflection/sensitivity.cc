#include "firmware-like/deflection/sensitivity.h"

#include <Eigen/LU>
#include <array>

namespace plumbline {
namespace {

using I = Influence<double>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxJoints, kMaxJoints>;

/// The wanted entries that an arm of n joints has, in ascending order.
int Entries(int n, const InfluenceSet& wanted, std::array<int, I::kSize>& entries) {
  int count = 0;
  for (int entry = 0; entry < I::kSize; ++entry) {
    const bool of_joint = entry < I::kJointEntries * kMaxJoints;
    if (of_joint && entry % kMaxJoints >= n) continue;
    if (wanted[static_cast<std::size_t>(entry)]) entries[static_cast<std::size_t>(count++)] = entry;
  }
  return count;
}

}  // namespace

bool SensitivityAt(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                   const Influence<double>& influence, const JointVector& measured_tau,
                   const InfluenceSet& wanted, Sensitivity& sensitivity) {
  if (!arm.AtCommanded(q, payload, &influence, measured_tau, sensitivity.state)) return false;
  const int n = arm.size();
  const JointVector theta = q + sensitivity.state.sag;
  sensitivity.p_W = sensitivity.state.p_read_W;
  sensitivity.dp.setZero();

  // The variables: theta first, then the entries; a chunk of them carries derivatives at a time.
  std::array<int, I::kSize> entries{};
  const int variables = n + Entries(n, wanted, entries);
  Eigen::Matrix<double, 3, kMaxJoints> p_theta;
  Square s_theta(n, n);
  Eigen::Matrix<double, kMaxJoints, I::kSize> s_x =
      Eigen::Matrix<double, kMaxJoints, I::kSize>::Zero();
  const PayloadOf<Dual> load{Dual(payload.mass_kg), payload.cog_F.cast<Dual>()};
  LoadedStateOf<Dual> state;
  for (int first = 0; first < variables; first += kDualWidth) {
    JointVectorOf<Dual> theta_dual = theta.cast<Dual>();
    Influence<Dual> influence_dual;
    for (int k = 0; k < I::kSize; ++k) influence_dual[k].a = influence[k];
    const int count = std::min(kDualWidth, variables - first);
    for (int k = 0; k < count; ++k) {
      const int variable = first + k;
      if (variable < n) {
        theta_dual[variable].v[k] = 1;
      } else {
        influence_dual[entries[static_cast<std::size_t>(variable - n)]].v[k] = 1;
      }
    }
    arm.Equations<Dual>(theta_dual, load, &influence_dual, measured_tau, state);
    const Vec3Of<Dual>& p_W = state.p_read_W;
    for (int k = 0; k < count; ++k) {
      const int variable = first + k;
      const Vec3 dp(p_W[0].v[k], p_W[1].v[k], p_W[2].v[k]);
      if (variable < n) {
        p_theta.col(variable) = dp;
        for (int i = 0; i < n; ++i) s_theta(i, variable) = state.sag[i].v[k];
      } else {
        const int entry = entries[static_cast<std::size_t>(variable - n)];
        sensitivity.dp.col(entry) = dp;
        for (int i = 0; i < n; ++i) s_x(i, entry) = state.sag[i].v[k];
      }
    }
  }
  // p_theta (I - s_theta)^-1 once, then every entry.
  const Square through = (Square::Identity(n, n) - s_theta).partialPivLu().inverse();
  sensitivity.dp += (p_theta.leftCols(n) * through).eval() * s_x.topRows(n);
  return true;
}

bool SensitivityAt(const LoadedArm& arm, const JointVector& q, const Payload& payload,
                   const Influence<double>& influence, const JointVector& measured_tau,
                   Sensitivity& sensitivity) {
  return SensitivityAt(arm, q, payload, influence, measured_tau, InfluenceSet{}.set(), sensitivity);
}

}  // namespace plumbline
