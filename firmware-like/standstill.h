// Standstill detector for the robot, based on its joint readings.
#pragma once

#include <algorithm>
#include <optional>

#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// The robot is at standstill once no joint has moved for this long. It exceeds the refresh period
/// of the slowest controller (PlausibilityLimits::slowest_refresh_s), so that the readings of a
/// moving arm change at least once within this time.
inline constexpr double kStandstill_s = 0.2;

/// A joint has moved if it differs from its reference position by more than 1.5 steps of its
/// register (a value at the edge of a step alternates between two adjacent ones) and by more than
/// this threshold, which is above the jitter of a servo that holds its position: 0.1 mrad is 0.3 mm
/// at 3 m [rad] or [m].
inline constexpr double kSmallestMotion = 1e-4;

/// Detects motion by comparing each reading with a reference position, which is updated only when a
/// joint has moved, not with the previous reading; slow creep therefore accumulates. Speeds from
/// 0.5 mrad/s are detected within kStandstill_s, slower ones intermittently. Does not allocate.
class StandstillDetector {
 public:
  /// @param reading  trusted; may be the same as in the previous call
  void Observe(const model::RobotState& reading) {
    const double allowed = std::max(kSmallestMotion, 1.5 * reading.q_resolution);
    const bool comparable = reference_ && reference_->size() == reading.q.size();
    const bool moved = comparable && (reading.q - *reference_).cwiseAbs().maxCoeff() > allowed;
    if (moved) moved_s_ = reading.timestamp_s;
    if (moved || !comparable) reference_ = reading.q;
  }

  /// False until the first motion is detected, because the first reading has no reference.
  bool Moving(double now_s) const { return moved_s_ && now_s - *moved_s_ <= kStandstill_s; }

 private:
  std::optional<model::JointVector> reference_;
  std::optional<double> moved_s_;  ///< time stamp of the latest reading in which a joint had moved
};

}  // namespace plumbline
