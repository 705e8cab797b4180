// Inverse kinematics: joint positions that bring the tip to a pose, on the nearest branch.
#pragma once

#include <cmath>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline {

/// Which of the pose's six numbers are wanted.
struct PoseTarget {
  Pose X_BT;
  bool orientation_free = false;
  int rows() const { return orientation_free ? 3 : 6; }
};

/// Remaining error of a pose: position [m], then the rotation vector from `have` to `want` [rad].
inline Vec6 PoseError(const PoseTarget& want, const Pose& have) {
  Vec6 error;
  error.head<3>() = want.X_BT.p - have.p;
  if (want.orientation_free) {
    error.tail<3>().setZero();
  } else {
    error.tail<3>() = VectorFromRotation(want.X_BT.R * have.R.transpose());
  }
  return error;
}

struct InverseOutcome {
  bool converged = false;
  double residual_m = 0;
  double residual_rad = 0;
  int iterations = 0;
};

inline constexpr double kInverseTolerance = 1e-9;  // [m] and [rad]

/// One step of a damped Newton iteration: the least change of joints that undoes `error`.
///   step = J^T (J J^T + damping)^-1 error      J: the wanted rows of the Jacobian
/// Far from the goal the damping keeps steps bounded beside singular postures; near it, it is far
/// below the smallest singular value that a correction may have.
JointVector DampedNewtonStep(const Jacobian& jacobian, int rows, const Vec6& error);

/// Damped Newton iteration from a seed for a tip given as a function
///   Pose tip(const JointVector& theta, Posture& posture)
/// whose derivative is close to the rigid Jacobian at the returned pose. Redundant arms take the
/// least change of joints. Allocates nothing.
/// @param theta  in: the seed, out: the solution [rad] or [m]
template <typename Tip>
InverseOutcome SolvePose(const Chain& chain, const PoseTarget& target, const Tip& tip,
                         int max_iterations, JointVector& theta) {
  constexpr double kLargestStep = 0.5;  // [rad] or [m] in one iteration
  InverseOutcome outcome;
  const int rows = target.rows();
  Posture posture;
  Jacobian jacobian;
  Vec6 error;
  for (; outcome.iterations < max_iterations; ++outcome.iterations) {
    const Pose X_BT = tip(theta, posture);
    error = PoseError(target, X_BT);
    if (error.cwiseAbs().maxCoeff() < kInverseTolerance) {
      outcome.converged = true;
      break;
    }
    chain.JacobianAt(posture, X_BT.p, jacobian);
    JointVector step = DampedNewtonStep(jacobian, rows, error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(largest)) break;
    if (largest > kLargestStep) step *= kLargestStep / largest;
    theta += step;
  }
  outcome.residual_m = error.head<3>().norm();
  outcome.residual_rad = error.tail<3>().norm();
  return outcome;
}

/// Brings every revolute joint, by whole turns, inside its limits and as near to the seed as they
/// allow. @return false where a joint stays outside
bool WrapIntoLimits(const Chain& chain, const JointVector& seed, JointVector& theta);

/// Starting posture number `index` of a fixed sequence that spreads over the joint ranges; the
/// first eight mirror the seed's wrist and elbow, the rest is a Halton sequence [Halton 1960].
JointVector RestartPosture(const Chain& chain, const JointVector& seed, int index);

/// Outcome of a search over branches.
enum class BranchOutcome { kFound, kOnlyOutsideLimits, kNone };

/// Of the solutions found from the seed and `restarts` other postures, the one within joint limits
/// that is nearest to the seed (least largest joint change).
template <typename Tip>
BranchOutcome SolvePoseOnNearestBranch(const Chain& chain, const PoseTarget& target, const Tip& tip,
                                       int restarts, const JointVector& seed, JointVector& theta,
                                       InverseOutcome& outcome) {
  constexpr int kIterations = 40;
  BranchOutcome best = BranchOutcome::kNone;
  double best_change = 0;
  int iterations = 0;
  for (int start = -1; start < restarts; ++start) {
    JointVector candidate = start < 0 ? seed : RestartPosture(chain, seed, start);
    const InverseOutcome tried = SolvePose(chain, target, tip, kIterations, candidate);
    iterations += tried.iterations;
    if (!tried.converged) continue;
    const bool inside = WrapIntoLimits(chain, seed, candidate);
    if (!inside && best == BranchOutcome::kFound) continue;
    const double change = (candidate - seed).cwiseAbs().maxCoeff();
    const bool better = best == BranchOutcome::kNone ||
                        (inside && best == BranchOutcome::kOnlyOutsideLimits) ||
                        change < best_change;
    if (!better) continue;
    best = inside ? BranchOutcome::kFound : BranchOutcome::kOnlyOutsideLimits;
    best_change = change;
    theta = candidate;
    outcome = tried;
  }
  outcome.iterations = iterations;
  return best;
}

/// Smallest singular value of the Jacobian's wanted rows, estimated from the inverse of J J^T
/// (never more than the true one, at least 1/sqrt(6) of it); 0 beside a singular posture.
double SmallestSingularValue(const Jacobian& jacobian, int rows);

}  // namespace plumbline
