// Plausibility filter for robot state: rejects stale, non-finite, discontinuous and out-of-range
// readings.
#pragma once

#include <cstdint>
#include <optional>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// Reason for rejecting a reading; kOk if it is accepted.
enum class InputFault : std::uint8_t {
  kOk,
  kMissing,      ///< no reading since start-up
  kStale,        ///< the last reading is too old
  kNotFinite,    ///< NaN or infinity
  kJointLimit,   ///< a joint outside its limits
  kJump,         ///< a joint moved faster than any joint can
  kJointCount,   ///< the number of joints differs from the cell's
  kTcpMismatch,  ///< the reported tool pose contradicts the joints: wrong decoding
  kTooSmall,     ///< a joint that is not zero, but smaller than any number a controller computes
  kAllZero,      ///< all joints zero in each reading since the last gap, and no tool pose
};
inline constexpr InputFault kLastInputFault = InputFault::kAllZero;

/// Short description for the log and the register map.
const char* Describe(InputFault fault);

/// What to do about it; empty if the fault itself says that.
const char* RemedyOf(InputFault fault);

struct PlausibilityLimits {
  double stale_after_s = 0.1;
  double limit_margin_rad = 0.02;  ///< beyond the declared joint limits
  double max_joint_speed = 12.0;   ///< [rad/s] or [m/s]
  /// A controller may refresh its registers more slowly than they are read. The allowed joint
  /// motion is therefore computed from the time since the last reading that differed, limited to
  /// this time.
  double slowest_refresh_s = 0.15;
  double max_joint_step = 0.05;  ///< always allowed between two readings [rad] or [m]
  /// Tolerances of the reported tool pose against forward kinematics, for a robot at standstill. On
  /// a moving robot, joints and tool pose of one reading may have been sampled at different times:
  /// twice the motion of the tool since the previous reading is added to the tolerance. Once the
  /// decoding has been verified, a contradiction counts only if it persists for
  /// `readings_to_contradict` readings (the arm may have just started to move).
  double tcp_tolerance_m = 0.010;
  double tcp_tolerance_rad = 0.02;
  int readings_to_contradict = 3;
  int readings_to_trust = 3;  ///< consecutive good readings required after a fault
  /// Words in the wrong order, or integers read as floats, give subnormal and other tiny floats:
  /// 12.5 with its words exchanged is 2.3e-41. Rounding in a controller leaves 1e-17 [rad] or [m].
  double least_magnitude = 1e-20;
  double zero = 1e-9;  ///< below it a joint counts as zero [rad] or [m]
};

/// Checks a stream of readings in order. Reads no clock; does not allocate.
class PlausibilityFilter {
 public:
  explicit PlausibilityFilter(const PlausibilityLimits& limits) : limits_(limits) {}

  /// Checks the latest reading at time now_s (monotonic). Call it every cycle, even if the reading
  /// is unchanged, because its age grows. After a fault, `readings_to_trust` consecutive good
  /// readings are required; until then the original fault is returned.
  /// @param mounted  index of the tool that the controller reports; nullopt if it reports none that
  ///                 the cell declares
  InputFault Check(const deflection::LoadedArm& arm, const model::RobotState& state, double now_s,
                   std::optional<int> mounted = std::nullopt);

  /// Copies the readings and trust of the filter that this one replaces, but keeps its own limits.
  /// Both filters must read the same link and an arm with the same number of joints.
  void ResumeFrom(const PlausibilityFilter& previous) {
    const PlausibilityLimits limits = limits_;
    *this = previous;
    limits_ = limits;
    tip_of_other_tool_.reset();  // an index into the tools of the previous arm
  }

  /// True once a reported tool pose has agreed with forward kinematics.
  bool decoding_checked() const { return decoding_checked_; }

  /// The tool whose tip the last reading has instead of that of the mounted one; nullopt if there
  /// is none.
  std::optional<int> tip_of_other_tool() const { return tip_of_other_tool_; }

 private:
  InputFault CheckNewReading(const deflection::LoadedArm& arm, const model::RobotState& state,
                             std::optional<int> mounted);

  PlausibilityLimits limits_;
  std::uint64_t sequence_ = 0;
  double changed_s_ = 0;  ///< time stamp of the reading that set last_q_
  model::JointVector last_q_;
  bool have_last_ = false;
  bool decoding_checked_ = false;
  bool seen_off_zero_ = false;  ///< a joint was not zero in a reading since the last gap
  std::optional<int> tip_of_other_tool_;
  int good_in_a_row_ = 0;
  int contradictions_in_a_row_ = 0;
  InputFault fault_ = InputFault::kMissing;
};

}  // namespace plumbline
