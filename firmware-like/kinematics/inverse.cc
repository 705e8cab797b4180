#include "firmware-like/kinematics/inverse.h"

#include <Eigen/Cholesky>
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
  const double damping = std::min(1e-3, 1e-2 * error.squaredNorm()) + 1e-14;
  Gram gram(rows, rows);
  gram.noalias() = J * J.transpose();
  gram.diagonal().array() += damping;
  return J.transpose() * gram.llt().solve(error.head(rows));
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
