#include "firmware-like/motion/joint_motion.h"

#include <Eigen/Dense>
#include <algorithm>

namespace plumbline::motion {
namespace {

constexpr double kRefreshesAtRest = 3;
constexpr int kParameters = 3;

/// Row of the design matrix at x.
Vec3 RowAt(double x) {
  return {1, x, 0.5 * x * x};
}

}  // namespace

void JointMotionEstimator::ObserveStandstill(const model::RobotState& reading) {
  count_ = 0;
  full_ = false;
  refresh_s_ = 0;
  sequence_ = reading.sequence;
  Append(reading);
  changed_s_ = reading.timestamp_s;
}

void JointMotionEstimator::ObserveMoving(const model::RobotState& reading) {
  if (count_ > 0 && reading.sequence == sequence_) return;
  if (count_ > 0 && At(count_ - 1).q.size() != reading.q.size()) Forget();
  sequence_ = reading.sequence;
  if (count_ == 0) {
    full_ = false;
    refresh_s_ = 0;
    changed_s_ = reading.timestamp_s;
    Append(reading);
    return;
  }
  if (At(count_ - 1).q != reading.q) {
    refresh_s_ = std::max(refresh_s_, reading.timestamp_s - changed_s_);
    changed_s_ = reading.timestamp_s;
    Append(reading);
  } else if (reading.timestamp_s - changed_s_ > kRefreshesAtRest * refresh_s_ && refresh_s_ > 0) {
    Append(reading);
  }
  while (count_ > 1 && At(0).time_s < reading.timestamp_s - kWindow_s) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
    full_ = true;
  }
}

void JointMotionEstimator::Append(const model::RobotState& reading) {
  if (count_ == kCapacity) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  samples_[(first_ + count_) % kCapacity] = {reading.timestamp_s, reading.q};
  ++count_;
  q_resolution_ = reading.q_resolution;
}

std::optional<JointMotion> JointMotionEstimator::Estimate() const {
  if (count_ < kLeastReadings) return std::nullopt;
  const double start_s = At(0).time_s, end_s = At(count_ - 1).time_s;
  const double half_s = 0.5 * (end_s - start_s);
  if (!(half_s > 0)) return std::nullopt;
  JointMotion motion;
  motion.time_s = 0.5 * (start_s + end_s);
  const auto x_of = [&](int k) { return (At(k).time_s - motion.time_s) / half_s; };
  // Positions relative to one of the readings, so that rounding does not matter.
  const model::JointVector origin = At(count_ / 2).q;
  const Eigen::Index joints = origin.size();
  using Coefficients =
      Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, model::kMaxJoints>;
  Mat3 normal = Mat3::Zero();
  Coefficients right = Coefficients::Zero(3, joints);
  for (int k = 0; k < count_; ++k) {
    const Vec3 row = RowAt(x_of(k));
    normal += row * row.transpose();
    right += row * (At(k).q - origin).transpose();
  }
  const Mat3 inverse = normal.inverse();
  const Coefficients c = inverse * right;
  JointMatrix scatter = JointMatrix::Zero(joints, joints);
  for (int k = 0; k < count_; ++k) {
    const model::JointVector residual = At(k).q - origin - c.transpose() * RowAt(x_of(k));
    scatter += residual * residual.transpose();
  }
  motion.freedom = count_ - kParameters;
  scatter /= motion.freedom;
  const double least_variance = q_resolution_ * q_resolution_ / 12;
  for (int i = 0; i < joints; ++i) scatter(i, i) = std::max(scatter(i, i), least_variance);
  motion.q = origin + c.row(0).transpose();
  motion.qd = c.row(1).transpose() / half_s;
  motion.qdd = c.row(2).transpose() / (half_s * half_s);
  motion.qdd_covariance = scatter * (inverse(2, 2) / (half_s * half_s * half_s * half_s));
  return motion;
}

}  // namespace plumbline::motion
