// Rate and step limiter for corrected points that are written into the controller.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/robot/push_codec.h"

namespace plumbline::robot {

struct PushLimits {
  bool enabled = false;
  double max_step_m = 0.005;  ///< largest position change of a slot between requests or writes
  double min_period_s = 0.1;  ///< between writes of the same slot

  bool operator==(const PushLimits&) const = default;
};

/// Action to take on one slot.
struct PushDecision {
  enum class Action : std::uint8_t {
    kNothing,   ///< nothing to do
    kWrite,     ///< write the point
    kWithdraw,  ///< write sequence 0: the point became invalid
    kHold,      ///< write sequence 0: the point jumped; it is written once it is steady
  };
  Action action = Action::kNothing;
  PushPoint point;
  double step_m = 0;  ///< size of the jump, for kHold
};

/// A point is written only if it lies within max_step_m of the previous request for its slot and of
/// the position that the slot holds. A jump, or a slow drift between two writes, withdraws the
/// slot; the point is written again once two requests agree and min_period_s has passed. A single
/// wrong reading therefore never reaches the robot, and a real change is announced by the sequence
/// 0 in between. Pure; time is an input.
class PushGate {
 public:
  PushGate(int slots, const PushLimits& limits);

  /// Evaluates all points and returns the next action; withdrawals first, then writes round-robin.
  PushDecision Next(std::span<const PushPoint> points, double now_s);

  /// True if the slot was ever requested and may hold a valid point.
  bool MayHoldPoint(int slot) const;

  /// Records that the point was written to its slot.
  void Written(const PushPoint& point, double now_s);
  /// Records that the slot was withdrawn.
  void Withdrawn(int slot, double now_s);

  /// Marks the contents of all slots as unknown, so that everything is written again.
  void Reset();

 private:
  struct Slot {
    bool named = false;      ///< was ever requested
    bool requested = false;  ///< the last request had a valid point
    Vec3 requested_p = Vec3::Zero();
    int requested_id = 0;
    double step_m = 0;  ///< distance of the request from the previous and the written one
    bool steady = false;
    bool holds_point = true;  ///< also true if unknown
    Vec3 written_p = Vec3::Zero();
    int written_id = 0;
    double written_s = 0;
    bool ever_written = false;
  };

  void Evaluate(const PushPoint& point, Slot& slot) const;
  PushDecision Decide(const PushPoint& point, const Slot& slot, double now_s) const;

  PushLimits limits_;
  std::vector<Slot> slots_;
  int last_slot_ = -1;
};

}  // namespace plumbline::robot
