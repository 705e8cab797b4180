#include "firmware-like/kinematics/inverse.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <numbers>

namespace plumbline::kinematics {
namespace {

using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

constexpr double kTurn = 2 * std::numbers::pi;

/// Element `index` (from 0) of the van der Corput sequence in a prime base; in (0, 1).
double RadicalInverse(int index, int base) {
  double value = 0;
  double digit = 1.0 / base;
  for (int remaining = index + 1; remaining > 0; remaining /= base) {
    value += digit * (remaining % base);
    digit /= base;
  }
  return value;
}

}  // namespace

model::JointVector DampedNewtonStep(const Jacobian& jacobian, int rows, const Vec6& error) {
  const auto J = jacobian.topRows(rows);
  const double damping = std::min(1e-3, 1e-2 * error.head(rows).squaredNorm()) + 1e-14;
  Gram gram(rows, rows);
  gram.noalias() = J * J.transpose();
  gram.diagonal().array() += damping;
  return J.transpose() * gram.llt().solve(error.head(rows));
}

namespace {

/// Smallest motion of the tip, per unit of joint motion, that counts as possible.
constexpr double kReachableTurn = 0.02;

/// Turns of the tip by joint motions that leave its position: J_r (I - J_p^+ J_p).
Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, model::kMaxJoints> TurnsInPlace(
    const Jacobian& jacobian) {
  const auto J_p = jacobian.topRows<3>();
  const auto J_r = jacobian.bottomRows<3>();
  Mat3 gram = J_p * J_p.transpose();
  gram.diagonal().array() += 1e-14;
  const Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, model::kMaxJoints> inverse_J_p =
      gram.llt().solve(J_p);
  return J_r - (J_r * J_p.transpose()) * inverse_J_p;
}

}  // namespace

model::JointVector NearestStep(const Jacobian& jacobian, const Vec6& error) {
  model::JointVector step = DampedNewtonStep(jacobian, 3, error);
  const auto turns = TurnsInPlace(jacobian);
  const Vec3 left = error.tail<3>() - jacobian.bottomRows<3>() * step;
  const Eigen::SelfAdjointEigenSolver<Mat3> modes(turns * turns.transpose());
  for (int mode = 0; mode < 3; ++mode) {
    const double square = modes.eigenvalues()[mode];
    if (square < kReachableTurn * kReachableTurn) continue;
    const Vec3 direction = modes.eigenvectors().col(mode);
    step += turns.transpose() * direction * (direction.dot(left) / square);
  }
  return step;
}

Orientation ReachableOrientation(const Chain& chain, const Vec3& tip_F) {
  constexpr int kPostures = 32, kFirst = 8;  // RestartPosture() mirrors its seed at smaller indices
  const model::JointVector zero = model::JointVector::Zero(chain.size());
  Posture posture;
  Jacobian jacobian;
  double any = 0, tilt = 0;  // squares of the smallest motion that the best posture allows
  for (int k = 0; k < kPostures; ++k) {
    chain.Evaluate(RestartPosture(chain, zero, kFirst + k), posture);
    chain.JacobianAt(posture, posture.X_BF() * tip_F, jacobian);
    const auto turns = TurnsInPlace(jacobian);
    const Mat3 square_T =
        posture.X_BF().R.transpose() * (turns * turns.transpose()) * posture.X_BF().R;
    const Eigen::Matrix2d across = square_T.topLeftCorner<2, 2>();
    any = std::max(any, Eigen::SelfAdjointEigenSolver<Mat3>(square_T).eigenvalues()[0]);
    tilt = std::max(tilt, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(across).eigenvalues()[0]);
  }
  constexpr double kLeast = kReachableTurn * kReachableTurn;
  return any > kLeast    ? Orientation::kFixed
         : tilt > kLeast ? Orientation::kAxis
                         : Orientation::kNearest;
}

bool WrapIntoLimits(const Chain& chain, const model::JointVector& seed, model::JointVector& theta) {
  bool inside = true;
  for (const int i : chain.coupling_order()) {
    if (chain.type(i) == model::JointType::kRevolute) {
      double wrapped = theta[i] - kTurn * std::round((theta[i] - seed[i]) / kTurn);
      if (wrapped > chain.upper()[i] && std::isfinite(chain.upper()[i])) {
        wrapped -= kTurn * std::ceil((wrapped - chain.upper()[i]) / kTurn);
      } else if (wrapped < chain.lower()[i] && std::isfinite(chain.lower()[i])) {
        wrapped += kTurn * std::ceil((chain.lower()[i] - wrapped) / kTurn);
      }
      // The other axes stay where they are, so joints coupled to this one change too.
      const double turned = wrapped - theta[i];
      if (turned != 0 && !chain.couplings().empty()) {
        theta += chain.ReportedFromAxes<double>(turned * model::JointVector::Unit(chain.size(), i));
      }
      theta[i] = wrapped;
    }
    inside = inside && theta[i] >= chain.lower()[i] && theta[i] <= chain.upper()[i];
  }
  return inside;
}

model::JointVector RestartPosture(const Chain& chain, const model::JointVector& seed, int index) {
  constexpr std::array<int, model::kMaxJoints> kPrimes = {2,  3,  5,  7,  11, 13,
                                                          17, 19, 23, 29, 31, 37};
  constexpr int kMirrored = 8;
  const int n = chain.size();
  model::JointVector start = seed;
  if (index < kMirrored && n == 6) {
    // The branches of an arm with a spherical wrist: flipped wrist, flipped elbow, arm turned by
    // half a turn about axis 1.
    start = chain.AxisPositions<double>(seed);
    if (index & 1) {
      start[3] += std::numbers::pi;
      start[4] = -start[4];
      start[5] -= std::numbers::pi;
    }
    if (index & 2) start[2] = -start[2];
    if (index & 4) start[0] += start[0] > 0 ? -std::numbers::pi : std::numbers::pi;
    start = chain.ReportedFromAxes<double>(start);
    if (index != 0) return start;
  }
  for (int i = 0; i < n; ++i) {
    const bool open = !std::isfinite(chain.lower()[i]) || !std::isfinite(chain.upper()[i]);
    const double low = open ? -std::numbers::pi : std::max(chain.lower()[i], -kTurn / 2);
    const double high = open ? std::numbers::pi : std::min(chain.upper()[i], kTurn / 2);
    start[i] = low + (high - low) * RadicalInverse(index, kPrimes[i]);
  }
  return start;
}

double SmallestSingularValue(const Jacobian& jacobian, int rows) {
  const Gram gram = jacobian.topRows(rows) * jacobian.topRows(rows).transpose();
  const auto lu = gram.partialPivLu();
  const double trace_of_inverse = lu.inverse().trace();
  return trace_of_inverse > 0 && std::isfinite(trace_of_inverse) ? 1 / std::sqrt(trace_of_inverse)
                                                                 : 0;
}

}  // namespace plumbline::kinematics
