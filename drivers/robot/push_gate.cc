#include "drivers/robot/push_gate.h"

#include <algorithm>

namespace plumbline::robot {

PushGate::PushGate(int slots, const PushLimits& limits)
    : limits_(limits), slots_(static_cast<std::size_t>(slots)) {}

void PushGate::Evaluate(const PushPoint& point, Slot& slot) const {
  slot.named = true;
  if (!point.valid) {
    slot.requested = false;
    slot.steady = false;
    return;
  }
  const bool follows = slot.requested && slot.requested_id == point.id;
  slot.step_m = follows ? (point.X_BT.p - slot.requested_p).norm() : 0;
  if (slot.holds_point && slot.ever_written && slot.written_id == point.id) {
    slot.step_m = std::max(slot.step_m, (point.X_BT.p - slot.written_p).norm());
  }
  slot.steady = slot.step_m <= limits_.max_step_m;  // false for NaN
  slot.requested = true;
  slot.requested_p = point.X_BT.p;
  slot.requested_id = point.id;
}

PushDecision PushGate::Decide(const PushPoint& point, const Slot& slot, double now_s) const {
  using Action = PushDecision::Action;
  if (!point.valid) return {slot.holds_point ? Action::kWithdraw : Action::kNothing, point, 0};
  if (!slot.steady)
    return {slot.holds_point ? Action::kHold : Action::kNothing, point, slot.step_m};
  if (slot.ever_written && now_s - slot.written_s < limits_.min_period_s) return {};
  return {Action::kWrite, point, 0};
}

PushDecision PushGate::Next(std::span<const PushPoint> points, double now_s) {
  for (const PushPoint& point : points) {
    if (point.slot >= 0 && point.slot < static_cast<int>(slots_.size())) {
      Evaluate(point, slots_[static_cast<std::size_t>(point.slot)]);
    }
  }
  PushDecision chosen;
  const int count = static_cast<int>(slots_.size());
  int best = count + 1;  // distance in round-robin order; withdrawals go first
  for (const PushPoint& point : points) {
    if (point.slot < 0 || point.slot >= count) continue;
    const PushDecision decision =
        Decide(point, slots_[static_cast<std::size_t>(point.slot)], now_s);
    if (decision.action == PushDecision::Action::kNothing) continue;
    const bool urgent = decision.action != PushDecision::Action::kWrite;
    const int turns = urgent ? -1 : (point.slot - last_slot_ - 1 + count) % count;
    if (turns < best) {
      best = turns;
      chosen = decision;
    }
  }
  if (chosen.action == PushDecision::Action::kWrite) last_slot_ = chosen.point.slot;
  return chosen;
}

bool PushGate::MayHoldPoint(int slot) const {
  const Slot& requested = slots_[static_cast<std::size_t>(slot)];
  return requested.named && requested.holds_point;
}

void PushGate::Written(const PushPoint& point, double now_s) {
  Slot& written = slots_[static_cast<std::size_t>(point.slot)];
  written.holds_point = true;
  written.written_p = point.X_BT.p;
  written.written_id = point.id;
  written.written_s = now_s;
  written.ever_written = true;
}

void PushGate::Withdrawn(int slot, double now_s) {
  Slot& written = slots_[static_cast<std::size_t>(slot)];
  written.holds_point = false;
  written.written_s = now_s;
  written.ever_written = true;
}

void PushGate::Reset() {
  for (Slot& slot : slots_) {
    slot.holds_point = true;
    slot.ever_written = false;
  }
}

}  // namespace plumbline::robot
