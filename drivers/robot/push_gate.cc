#include "drivers/robot/push_gate.h"

#include <algorithm>

namespace plumbline {

PushGate::PushGate(int slots, const PushLimits& limits)
    : limits_(limits), slots_(static_cast<std::size_t>(slots)) {}

void PushGate::Judge(const PushPoint& point, Slot& slot) const {
  slot.named = true;
  if (!point.valid) {
    slot.asked = false;
    slot.steady = false;
    return;
  }
  const bool follows = slot.asked && slot.asked_id == point.id;
  slot.step_m = follows ? (point.X_BT.p - slot.asked_p).norm() : 0;
  if (slot.holds_point && slot.ever_written && slot.written_id == point.id) {
    slot.step_m = std::max(slot.step_m, (point.X_BT.p - slot.written_p).norm());
  }
  slot.steady = slot.step_m <= limits_.max_step_m;  // a NaN is not steady
  slot.asked = true;
  slot.asked_p = point.X_BT.p;
  slot.asked_id = point.id;
}

PushOrder PushGate::OrderFor(const PushPoint& point, const Slot& slot, double now_s) const {
  using Action = PushOrder::Action;
  if (!point.valid) return {slot.holds_point ? Action::kWithdraw : Action::kNothing, point, 0};
  if (!slot.steady)
    return {slot.holds_point ? Action::kHold : Action::kNothing, point, slot.step_m};
  if (slot.ever_written && now_s - slot.written_s < limits_.min_period_s) return {};
  return {Action::kWrite, point, 0};
}

PushOrder PushGate::Next(std::span<const PushPoint> points, double now_s) {
  for (const PushPoint& point : points) {
    if (point.slot >= 0 && point.slot < static_cast<int>(slots_.size())) {
      Judge(point, slots_[static_cast<std::size_t>(point.slot)]);
    }
  }
  PushOrder chosen;
  const int count = static_cast<int>(slots_.size());
  int best = count + 1;  // turns to wait for; withdrawals go first
  for (const PushPoint& point : points) {
    if (point.slot < 0 || point.slot >= count) continue;
    const PushOrder order = OrderFor(point, slots_[static_cast<std::size_t>(point.slot)], now_s);
    if (order.action == PushOrder::Action::kNothing) continue;
    const bool urgent = order.action != PushOrder::Action::kWrite;
    const int turns = urgent ? -1 : (point.slot - last_slot_ - 1 + count) % count;
    if (turns < best) {
      best = turns;
      chosen = order;
    }
  }
  if (chosen.action == PushOrder::Action::kWrite) last_slot_ = chosen.point.slot;
  return chosen;
}

bool PushGate::MayHold(int slot) const {
  const Slot& asked = slots_[static_cast<std::size_t>(slot)];
  return asked.named && asked.holds_point;
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

void PushGate::Forget() {
  for (Slot& slot : slots_) {
    slot.holds_point = true;
    slot.ever_written = false;
  }
}

}  // namespace plumbline
