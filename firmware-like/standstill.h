// Standstill of the robot, from its joint readings.
#pragma once

#include <algorithm>
#include <optional>

#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// The robot stands once no joint has left its place for this long: longer than the slowest
/// controller takes to refresh its registers (PlausibilityLimits::slowest_refresh_s), so that an
/// arm in motion shows at least one change within it.
inline constexpr double kStandstill_s = 0.2;

/// A joint has left its place where it is farther from it than 1.5 steps of its register (a value
/// at the edge of a step alternates between two) and than this, which is above the jitter of a
/// servo that holds its position: 0.1 mrad is 0.3 mm at 3 m [rad] or [m].
inline constexpr double kSmallestMotion = 1e-4;

/// Compares each reading with the place where every joint was last found to have moved to, not with
/// the reading before: a creeping arm adds up. Over kStandstill_s a speed from 0.5 mrad/s is seen
/// at once; a slower one from time to time. Values in, verdict out; allocates nothing.
class StandstillWatch {
 public:
  /// @param reading  trusted; the same one may be given again
  void Observe(const RobotState& reading) {
    const double allowed = std::max(kSmallestMotion, 1.5 * reading.q_resolution);
    const bool comparable = place_ && place_->size() == reading.q.size();
    const bool left = comparable && (reading.q - *place_).cwiseAbs().maxCoeff() > allowed;
    if (left) moved_s_ = reading.timestamp_s;
    if (left || !comparable) place_ = reading.q;
  }

  /// False until a motion was seen: what is read first has no reading to be compared with.
  bool Moving(double now_s) const { return moved_s_ && now_s - *moved_s_ <= kStandstill_s; }

 private:
  std::optional<JointVector> place_;
  std::optional<double> moved_s_;  ///< of the newest reading in which a joint had left its place
};

}  // namespace plumbline
