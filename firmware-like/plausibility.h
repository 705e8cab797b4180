// Is what the robot controller says to be believed?
#pragma once

#include <cstdint>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// Why a reading is not believed; kOk where it is.
enum class InputFault : std::uint8_t {
  kOk,
  kMissing,      ///< nothing was read since the start
  kStale,        ///< the last reading is too old
  kNotFinite,    ///< NaN or infinity
  kJointLimit,   ///< a joint outside its limits
  kJump,         ///< a joint moved faster than any joint can
  kJointCount,   ///< not as many joints as the cell declares
  kTcpMismatch,  ///< the reported tool pose is not the one that the joints give: wrong decoding
};

const char* Describe(InputFault fault);

struct PlausibilityLimits {
  double stale_after_s = 0.1;
  double limit_margin_rad = 0.02;  ///< beyond the declared joint limits
  double max_joint_speed = 12.0;   ///< [rad/s] or [m/s]
  /// A controller may refresh its registers more slowly than they are read: the speed counts from
  /// the last reading that differed, as far back as this.
  double slowest_refresh_s = 0.15;
  double max_joint_step = 0.05;  ///< always allowed between two readings
  /// Reported tool pose against forward kinematics, for a robot at rest. While it moves, joints and
  /// tool pose may belong to two moments of one reading: what the flange moved since the reading
  /// before is allowed as well, twice; and once the decoding has been checked, a contradiction
  /// counts only when it stands for `readings_to_contradict` readings (the arm just began to move).
  double tcp_tolerance_m = 0.010;
  double tcp_tolerance_rad = 0.02;
  int readings_to_contradict = 3;
  int readings_to_trust = 3;  ///< consistent readings needed after a fault
};

/// Judges readings in their order. Values in, verdict out; time is an input.
class PlausibilityFilter {
 public:
  explicit PlausibilityFilter(const PlausibilityLimits& limits) : limits_(limits) {}

  /// Verdict on the newest reading at time now_s. The same reading may be judged again: its age
  /// grows. After a fault, `readings_to_trust` good readings in a row are needed; until then the
  /// fault that caused it is told.
  InputFault Judge(const LoadedArm& arm, const RobotState& state, double now_s);

  /// Goes on with another filter's readings and trust, under its own limits. For arms of as many
  /// joints, and readings of the same link.
  void TakeOver(const PlausibilityFilter& former) {
    const PlausibilityLimits limits = limits_;
    *this = former;
    limits_ = limits;
  }

  /// False until a reported tool pose was compared with forward kinematics.
  bool decoding_checked() const { return decoding_checked_; }

 private:
  InputFault JudgeNew(const LoadedArm& arm, const RobotState& state);

  PlausibilityLimits limits_;
  std::uint64_t sequence_ = 0;
  double changed_s_ = 0;  ///< timestamp of the reading in which last_q_ was new
  JointVector last_q_;
  bool have_last_ = false;
  bool decoding_checked_ = false;
  int good_in_a_row_ = 0;
  int contradictions_in_a_row_ = 0;
  InputFault fault_ = InputFault::kMissing;
};

}  // namespace plumbline
