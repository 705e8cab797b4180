// Joint speeds and accelerations estimated from polled joint positions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware-like/model/robot_state.h"

namespace plumbline::motion {

using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                  model::kMaxJoints, model::kMaxJoints>;

/// Speeds and accelerations at one instant.
struct JointMotion {
  double time_s = 0;           ///< the instant: the middle of the readings used, monotonic
  model::JointVector q;        ///< [rad] or [m]
  model::JointVector qd;       ///< [rad/s] or [m/s]
  model::JointVector qdd;      ///< [rad/s^2] or [m/s^2]
  JointMatrix qdd_covariance;  ///< of qdd, from the scatter of the readings
  int freedom = 0;             ///< degrees of freedom of that covariance
};

/// Fits a parabola to the readings of the last kWindow_s of each joint:
///   q(t) = c0 + c1 x + c2 x^2 / 2,  x = (t - t_middle) / h,  h = half the time span
///   qd = c1 / h,  qdd = c2 / h^2    [second-order Savitzky-Golay filter for uneven sampling]
/// and takes the covariance of qdd from the residuals r of all joints together,
///   Cov(qdd) = R^T R / (N - 3) * [(A^T A)^-1]_22 / h^4,
/// so that an error in the time of a reading, which acts on all joints at once, counts as such. The
/// variance of a joint is at least that of the steps of its register. N readings of sd s spread
/// evenly over the window give an sd of about 27 s / (sqrt(N) kWindow_s^2).
///
/// Repeated positions are not readings: a controller may refresh its registers more slowly than
/// they are polled. After a stop they count again once they have lasted for three refresh periods.
/// A reading may be one refresh period older than its arrival, so the instant is known to that.
/// Valid for motion whose acceleration changes little within the window: the bias is
/// h^2/14 d4q/dt4. Vibrations above about 1 / kWindow_s are not resolved. Does not allocate.
class JointMotionEstimator {
 public:
  static constexpr double kWindow_s = 0.12;
  /// Fewer readings in a full window do not determine the acceleration. Corresponds to a refresh
  /// period of 20 ms.
  static constexpr int kLeastReadings = 7;

  /// @param reading  trusted; may be the same as in the previous call
  void ObserveMoving(const model::RobotState& reading);
  /// The robot is at standstill: the motion that follows starts from this reading.
  void ObserveStandstill(const model::RobotState& reading);
  void Forget() { count_ = 0; }

  /// True if the readings span the whole window.
  bool full() const { return full_; }
  /// @return  nullopt if there are too few readings in the window
  std::optional<JointMotion> Estimate() const;

 private:
  struct Sample {
    double time_s = 0;
    model::JointVector q;
  };
  static constexpr int kCapacity = 128;  ///< the window at a cycle of 1 ms

  const Sample& At(int k) const { return samples_[(first_ + k) % kCapacity]; }
  void Append(const model::RobotState& reading);

  std::array<Sample, kCapacity> samples_;
  int first_ = 0, count_ = 0;
  bool full_ = false;
  double changed_s_ = 0;     ///< time of the latest reading that differed from its predecessor
  double refresh_s_ = 0;     ///< longest time between two changes since the motion started
  double q_resolution_ = 0;  ///< [rad]
  std::uint64_t sequence_ = 0;
};

}  // namespace plumbline::motion
