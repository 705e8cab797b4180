// Inverse kinematics by damped Newton iteration, with a search for the nearest branch.
#pragma once

#include <cmath>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::kinematics {

/// What a target demands of the tip's orientation, beside its exact position.
enum class Orientation {
  kFixed,    ///< all of it
  kAxis,     ///< the direction of the tip's z axis, the tool's; the turn about it follows
  kNearest,  ///< as close to it as the arm comes
  kFree,     ///< nothing
};

/// The orientation that an arm can be asked for together with a position: kFixed if it can turn the
/// tip about any axis in place, kAxis if it can tilt the tool in both directions (five axes), else
/// kNearest (four axes, SCARA). From the Jacobian in a sample of postures; allocates nothing.
/// @param tip_F  tip in the flange frame [m]
Orientation ReachableOrientation(const Chain& chain, const Vec3& tip_F);

/// Target pose of the tip.
struct PoseTarget {
  Pose X_BT;
  Orientation orientation = Orientation::kFixed;
  /// Rows of the Jacobian and of the error that must vanish.
  int rows() const {
    return orientation == Orientation::kFixed ? 6 : orientation == Orientation::kAxis ? 5 : 3;
  }
};

/// Error of a pose: position [m], then the rotation vector from `actual` to `target` [rad], in B.
/// With kAxis, the rotation that aligns the z axes, in the frame of the tip; with kFree, zero.
inline Vec6 PoseError(const PoseTarget& target, const Pose& actual) {
  Vec6 error;
  error.head<3>() = target.X_BT.p - actual.p;
  error.tail<3>().setZero();
  if (target.orientation == Orientation::kAxis) {
    const Vec3 z_T = actual.R.transpose() * target.X_BT.R.col(2);
    const double sine = std::hypot(z_T.x(), z_T.y());
    if (sine > 0) {
      error.segment<2>(3) = std::atan2(sine, z_T.z()) / sine * Eigen::Vector2d(-z_T.y(), z_T.x());
    } else if (z_T.z() < 0) {
      error[3] = std::acos(-1.0);
    }
  } else if (target.orientation != Orientation::kFree) {
    error.tail<3>() = VectorFromRotation(target.X_BT.R * actual.R.transpose());
  }
  return error;
}

/// Expresses the angular rows of a Jacobian in the frame in which PoseError() has them.
inline void OrientRows(const PoseTarget& target, const Mat3& R_BT, Jacobian& jacobian) {
  if (target.orientation != Orientation::kAxis) return;
  jacobian.bottomRows<3>() = (R_BT.transpose() * jacobian.bottomRows<3>()).eval();
}

struct InverseOutcome {
  bool converged = false;
  double residual_m = 0;
  double residual_rad = 0;
  int iterations = 0;
};

inline constexpr double kInverseTolerance = 1e-9;  // [m] and [rad]

/// One step of a damped Newton iteration: the smallest joint change that removes `error`.
///   step = J^T (J J^T + damping)^-1 error      J: the first `rows` rows of the Jacobian
/// Far from the target, the damping bounds the steps near singular postures; close to the target it
/// is far below the smallest singular value that a correction may have.
model::JointVector DampedNewtonStep(const Jacobian& jacobian, int rows, const Vec6& error);

/// A step of Gauss and Newton to the smallest orientation error at the target's position: the
/// damped step for the position, and among the motions that leave the position the one that removes
/// most of the orientation error. Directions in which the arm turns the tip by less than 2 % of its
/// joints' motion count as unreachable: of a SCARA, the tilt of its sagging axes.
model::JointVector NearestStep(const Jacobian& jacobian, const Vec6& error);

/// Solves tip(theta) = target by damped Newton iteration from a seed. The tip is a function
///   Pose tip(const JointVector& theta, Posture& posture)
/// whose derivative is close to the rigid Jacobian at the returned pose. Redundant arms move their
/// joints as little as possible. Does not allocate.
/// With Orientation::kNearest, converges if the position is reached and the step vanishes.
/// @param theta  in: the seed, out: the solution [rad] or [m]
/// @return       `converged` is false after max_iterations or at a singular posture
template <typename Tip>
InverseOutcome SolvePose(const Chain& chain, const PoseTarget& target, const Tip& tip,
                         int max_iterations, model::JointVector& theta) {
  constexpr double kLargestStep = 0.5;  // [rad] or [m] in one iteration
  InverseOutcome outcome;
  const int rows = target.rows();
  const bool nearest = target.orientation == Orientation::kNearest;
  Posture posture;
  Jacobian jacobian;
  Vec6 error;
  for (; outcome.iterations < max_iterations; ++outcome.iterations) {
    const Pose X_BT = tip(theta, posture);
    error = PoseError(target, X_BT);
    const bool reached = error.head(rows).cwiseAbs().maxCoeff() < kInverseTolerance;
    if (reached && !nearest) {
      outcome.converged = true;
      break;
    }
    chain.JacobianAt(posture, X_BT.p, jacobian);
    OrientRows(target, X_BT.R, jacobian);
    model::JointVector step =
        nearest ? NearestStep(jacobian, error) : DampedNewtonStep(jacobian, rows, error);
    const double largest = step.cwiseAbs().maxCoeff();
    if (reached && largest < kInverseTolerance) {
      outcome.converged = true;
      break;
    }
    if (!std::isfinite(largest)) break;
    if (largest > kLargestStep) step *= kLargestStep / largest;
    theta += step;
  }
  outcome.residual_m = error.head<3>().norm();
  outcome.residual_rad = error.tail<3>().norm();
  return outcome;
}

/// Shifts every revolute joint by whole turns into its limits and as close to the seed as possible.
/// @return false if a joint remains outside its limits
bool WrapIntoLimits(const Chain& chain, const model::JointVector& seed, model::JointVector& theta);

/// Start posture number `index` of a fixed sequence that covers the joint ranges. The first eight
/// mirror the seed's wrist and elbow; the others form a Halton sequence [Halton 1960].
model::JointVector RestartPosture(const Chain& chain, const model::JointVector& seed, int index);

/// Outcome of a search over branches.
enum class BranchOutcome { kFound, kOnlyOutsideLimits, kNone };

/// Solves from the seed and from `restarts` other start postures, and selects the solution within
/// the joint limits that is nearest to the seed (smallest maximum joint change). With
/// Orientation::kNearest, the one with the smallest orientation error; among equal ones, the
/// nearest.
/// @param theta  out: the solution [rad] or [m]; unchanged for BranchOutcome::kNone
template <typename Tip>
BranchOutcome SolvePoseOnNearestBranch(const Chain& chain, const PoseTarget& target, const Tip& tip,
                                       int restarts, const model::JointVector& seed,
                                       model::JointVector& theta, InverseOutcome& outcome) {
  constexpr int kIterations = 40;
  constexpr double kSameResidual_rad = 1e-6;
  BranchOutcome best = BranchOutcome::kNone;
  double best_change = 0;
  int iterations = 0;
  for (int start = -1; start < restarts; ++start) {
    model::JointVector candidate = start < 0 ? seed : RestartPosture(chain, seed, start);
    const InverseOutcome tried = SolvePose(chain, target, tip, kIterations, candidate);
    iterations += tried.iterations;
    if (!tried.converged) continue;
    const bool inside = WrapIntoLimits(chain, seed, candidate);
    if (!inside && best == BranchOutcome::kFound) continue;
    const double change = (candidate - seed).cwiseAbs().maxCoeff();
    const double gained_rad = outcome.residual_rad - tried.residual_rad;
    const bool better =
        best == BranchOutcome::kNone || (inside && best == BranchOutcome::kOnlyOutsideLimits) ||
        gained_rad > kSameResidual_rad || (gained_rad > -kSameResidual_rad && change < best_change);
    if (!better) continue;
    best = inside ? BranchOutcome::kFound : BranchOutcome::kOnlyOutsideLimits;
    best_change = change;
    theta = candidate;
    outcome = tried;
  }
  outcome.iterations = iterations;
  return best;
}

/// Lower bound of the smallest singular value of the Jacobian's first `rows` rows, from the trace
/// of (J J^T)^-1; at least 1/sqrt(6) of the true value. 0 at a singular posture.
double SmallestSingularValue(const Jacobian& jacobian, int rows);

}  // namespace plumbline::kinematics
