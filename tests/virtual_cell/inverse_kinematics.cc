#include "tests/virtual_cell/inverse_kinematics.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace virtual_cell {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

constexpr double kTolerance = 1e-9;

/// Finite limits for random start postures: one turn to each side for an unlimited joint.
double Low(const JointDescription& joint) {
  return std::max(joint.min, -3.1);
}
double High(const JointDescription& joint) {
  return std::min(joint.max, 3.1);
}

/// Upper bound of the reach: the sum of all link lengths.
bool BeyondReach(const CellDescription& cell, const Motion& X_BT) {
  double reach = cell.tip_F.norm();
  for (const JointDescription& joint : cell.joints) {
    if (joint.prismatic) return false;
    reach += std::hypot(joint.a_m, joint.d_m);
  }
  return X_BT.translation().norm() > reach;
}

Joints Clamped(const CellDescription& cell, Joints q) {
  for (int i = 0; i < cell.size(); ++i) {
    const JointDescription& joint = cell.joints[static_cast<std::size_t>(i)];
    q[i] = std::clamp(q[i], joint.min, joint.max);
  }
  return q;
}

std::optional<Joints> Descend(const CellDescription& cell, const Arm& arm, const Motion& X_BT,
                              Joints q) {
  double damping = 1e-3;
  double last_error = 1e300;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Posture posture = PostureAt(arm, q);
    const Motion tip = posture.links.back() * Eigen::Translation3d(cell.tip_F);
    Vec6 error;
    error << X_BT.translation() - tip.translation(),
        VectorFromRotation(X_BT.linear() * tip.linear().transpose());
    if (error.head<3>().norm() < kTolerance && error.tail<3>().norm() < kTolerance) return q;
    damping = error.norm() < last_error ? damping * 0.3 : std::min(damping * 4, 1.0);
    last_error = error.norm();

    Eigen::MatrixXd J(6, cell.size());
    for (int i = 0; i < cell.size(); ++i) {
      const Screw& screw = posture.screws[static_cast<std::size_t>(i)];
      J.col(i) << screw.v + screw.omega.cross(tip.translation()), screw.omega;
    }
    const Eigen::Matrix<double, 6, 6> A =
        J * J.transpose() + damping * damping * Eigen::Matrix<double, 6, 6>::Identity();
    Joints step = J.transpose() * A.ldlt().solve(error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (largest > 0.4) step *= 0.4 / largest;
    q = Clamped(cell, q + step);
  }
  return std::nullopt;
}

}  // namespace

Motion NominalTip(const CellDescription& cell, const Arm& arm, const Joints& q) {
  return PostureAt(arm, q).links.back() * Eigen::Translation3d(cell.tip_F);
}

std::optional<Joints> SolveInverseKinematics(const CellDescription& cell, const Arm& arm,
                                             const Motion& X_BT, const Joints& start) {
  if (BeyondReach(cell, X_BT)) return std::nullopt;
  if (std::optional<Joints> q = Descend(cell, arm, X_BT, start)) return q;
  std::mt19937 random(1);
  std::optional<Joints> nearest;
  for (int attempt = 0; attempt < 12; ++attempt) {
    Joints seed(cell.size());
    for (int i = 0; i < cell.size(); ++i) {
      const JointDescription& joint = cell.joints[static_cast<std::size_t>(i)];
      seed[i] = std::uniform_real_distribution<double>(Low(joint), High(joint))(random);
    }
    const std::optional<Joints> q = Descend(cell, arm, X_BT, seed);
    if (q && (!nearest || (*q - start).norm() < (*nearest - start).norm())) nearest = q;
  }
  return nearest;
}

}  // namespace virtual_cell
