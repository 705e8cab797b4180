// Decides which corrected point may be written into the controller now: rate and step limits.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/robot/push_codec.h"

namespace plumbline {

struct PushLimits {
  bool enabled = false;
  double max_step_m =
      0.005;  ///< largest change of a slot's position from one write or request to the next
  double min_period_s = 0.1;  ///< between two writes of the same slot

  bool operator==(const PushLimits&) const = default;
};

/// What to do with one slot.
struct PushOrder {
  enum class Action : std::uint8_t {
    kNothing,   ///< nothing is due
    kWrite,     ///< write the point
    kWithdraw,  ///< write sequence 0: the point became invalid
    kHold,      ///< write sequence 0: the point jumped; it is written once it stays
  };
  Action action = Action::kNothing;
  PushPoint point;
  double step_m = 0;  ///< of kHold
};

/// A point is written only where the request before it, for the same slot, lies within
/// max_step_m, and so does what the slot holds of it. A jump, or a creeping change between two
/// writes, therefore withdraws the slot, and the point is written again as soon as two requests
/// agree and min_period_s has passed: a single wrong reading never reaches the robot, and a real
/// change is announced to it by the sequence 0 in between.
class PushGate {
 public:
  PushGate(int slots, const PushLimits& limits);

  /// The next order, slots in turn. Every point's jump is judged at every call.
  PushOrder Next(std::span<const PushPoint> points, double now_s);

  /// A request named the slot, and it may hold a valid point.
  bool MayHold(int slot) const;

  /// The point's slot holds it since now_s.
  void Written(const PushPoint& point, double now_s);
  /// The slot holds nothing valid since now_s.
  void Withdrawn(int slot, double now_s);

  /// The controller's registers are unknown again: everything is due.
  void Forget();

 private:
  struct Slot {
    bool named = false;  ///< by any request
    bool asked = false;  ///< a valid point was asked for in the last request
    Vec3 asked_p = Vec3::Zero();
    int asked_id = 0;
    double step_m = 0;  ///< of the last request against the one before, and what is written
    bool steady = false;
    bool holds_point = true;  ///< unknown counts as holding one
    Vec3 written_p = Vec3::Zero();
    int written_id = 0;
    double written_s = 0;
    bool ever_written = false;
  };

  void Judge(const PushPoint& point, Slot& slot) const;
  PushOrder OrderFor(const PushPoint& point, const Slot& slot, double now_s) const;

  PushLimits limits_;
  std::vector<Slot> slots_;
  int last_slot_ = -1;
};

}  // namespace plumbline
