#include "drivers/robot/modbus_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace plumbline::robot {
PushGate::PushGate(int slots, const PushLimits& limits, Writes writes)
    : limits_(limits), writes_(writes), slots_(static_cast<std::size_t>(slots)) {}

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
  const bool waits = writes_ == Writes::kAtPeriod || !slot.holds_point;
  if (waits && slot.ever_written && now_s - slot.written_s < limits_.min_period_s) return {};
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

namespace {

constexpr int kPasses = 3;  // over the blocks, until the controller does not refresh in between

std::string_view FitText(PushFit fit) {
  switch (fit) {
    case PushFit::kFits:
      return "fits";
    case PushFit::kNoSuchSlot:
      return "the profile has no such slot";
    case PushFit::kBadId:
      return "its id is outside 0..65535";
    case PushFit::kNotFinite:
      return "it is not finite";
    case PushFit::kOutOfRange:
      return "a value does not fit the profile's register type";
  }
  return "unknown";
}

std::uint16_t SequenceAfter(std::uint16_t sequence) {
  return sequence == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(sequence + 1);
}

}  // namespace

Result<std::unique_ptr<RobotDevice>> ModbusRobot::Create(const RobotProfile& profile, ReadPlan plan,
                                                         ModbusClient client,
                                                         const PushLimits& limits, Clock clock) {
  Result<RobotCodec> codec = RobotCodec::Create(profile);
  if (!codec) return codec.failure();
  if (limits.enabled && !profile.push) {
    return Error{fmt::format("push is enabled, but robot profile \"{}\" has no [push] registers",
                             profile.name)};
  }
  if (profile.push && !IsConsistent(*profile.push)) {
    return Error{fmt::format("robot profile \"{}\": the push slots overlap or exceed the registers",
                             profile.name)};
  }
  return std::unique_ptr<RobotDevice>(new ModbusRobot(
      std::move(codec).value(), profile, std::move(plan), std::move(client), limits, clock));
}

ModbusRobot::ModbusRobot(RobotCodec codec, const RobotProfile& profile, ReadPlan plan,
                         ModbusClient client, const PushLimits& limits, Clock clock)
    : codec_(std::move(codec)),
      plan_(std::move(plan)),
      client_(std::move(client)),
      clock_(clock),
      words_(static_cast<std::size_t>(codec_.word_count())),
      can_push_(limits.enabled && profile.push),
      push_(profile.push.value_or(PushProfile{})),
      limits_(limits),
      gate_(push_.slots, limits),
      slot_sequence_(static_cast<std::size_t>(push_.slots)) {}

std::string_view ModbusRobot::problem() const {
  if (client_problem_) return client_.problem();
  return {problem_.data(), problem_size_};
}

LinkResult ModbusRobot::Refuse(LinkResult result, std::string_view text) {
  const auto written = fmt::format_to_n(problem_.begin(), problem_.size(), "{}", text);
  problem_size_ = std::min(written.size, problem_.size());
  client_problem_ = false;
  return result;
}

LinkResult ModbusRobot::Read(model::RobotState& state) {
  client_problem_ = true;
  if (const LinkResult result = client_.Connect(); result != LinkResult::kOk) return result;
  LinkResult result = LinkResult::kTorn;
  double started_s = 0;
  for (int pass = 0; pass < kPasses && result == LinkResult::kTorn; ++pass) {
    started_s = clock_();
    result = ReadBlocks();
  }
  if (result == LinkResult::kTorn) {
    return Refuse(
        result,
        "the controller refreshes its registers faster than joints and load are read: put "
        "them into one [[read]], or omit [sequence] from the profile");
  }
  if (result != LinkResult::kOk) return result;
  client_.ResetBackOff();
  codec_.RobotStateFromRegisters(words_, state);
  NoteReading(started_s, state);
  return LinkResult::kOk;
}

LinkResult ModbusRobot::ReadBlocks() {
  for (const auto& [block, place] : plan_.steps) {
    const auto words = std::span(words_).subspan(place, static_cast<std::size_t>(block.count));
    if (const LinkResult result = client_.Read(block, words); result != LinkResult::kOk)
      return result;
  }
  if (plan_.markers.empty()) return LinkResult::kOk;
  const RegisterBlock& marker = client_.NextMarker();
  std::array<std::uint16_t, kMaxRegistersOfRead> words{};
  const LinkResult result = client_.Read(marker, words);
  if (result != LinkResult::kOk || !plan_.compares_refresh) return result;
  const bool same = codec_.RefreshCounter(words, marker) == codec_.RefreshCounter(words_);
  return same ? LinkResult::kOk : LinkResult::kTorn;
}

void ModbusRobot::NoteReading(double started_s, model::RobotState& state) {
  const std::optional<std::uint32_t> refresh = codec_.RefreshCounter(words_);
  if (sequence_ == 0 || !refresh || refresh != refresh_) {
    timestamp_s_ = started_s;
    ++sequence_;
  }
  refresh_ = refresh;
  state.timestamp_s = timestamp_s_;
  state.sequence = sequence_;
}

LinkResult ModbusRobot::Push(std::span<const PushPoint> points) {
  if (!can_push_) return Refuse(LinkResult::kPushRefused, "push is not enabled");
  client_problem_ = true;
  if (!client_.connected()) return LinkResult::kWaiting;
  NoteConnection();
  const PushDecision decision = gate_.Next(points, clock_());
  if (decision.action == PushDecision::Action::kWrite) return WritePoint(decision.point);
  if (decision.action == PushDecision::Action::kNothing) return LinkResult::kOk;
  const LinkResult result = Withdraw(decision.point.slot);
  if (result != LinkResult::kOk || decision.action == PushDecision::Action::kWithdraw)
    return result;
  return Refuse(LinkResult::kPushRefused,
                fmt::format("point {} in slot {} moved by {:.3f} mm, more than {:.3f} mm: "
                            "withdrawn until it is steady",
                            decision.point.id, decision.point.slot, 1e3 * decision.step_m,
                            1e3 * limits_.max_step_m));
}

LinkResult ModbusRobot::WithdrawAll(double within_s) {
  if (!can_push_) return LinkResult::kOk;
  const double end_s = clock_() + within_s;
  client_problem_ = true;
  NoteConnection();
  LinkResult worst = LinkResult::kOk;
  for (int slot = 0; slot < push_.slots; ++slot) {
    if (!gate_.MayHoldPoint(slot)) continue;
    if (!client_.connected()) return worst == LinkResult::kOk ? LinkResult::kWaiting : worst;
    const double left_s = end_s - clock_();
    if (left_s <= 0) return Refuse(LinkResult::kTimeout, "no time left to withdraw every slot");
    client_.LimitTimeout(left_s);
    if (const LinkResult result = Withdraw(slot); result != LinkResult::kOk) worst = result;
  }
  client_.LimitTimeout(std::numeric_limits<double>::infinity());
  return worst;
}

/// After a reconnection the contents of the slots are unknown.
void ModbusRobot::NoteConnection() {
  if (connection_ == client_.connections()) return;
  connection_ = client_.connections();
  gate_.Reset();
}

LinkResult ModbusRobot::Withdraw(int slot) {
  const LinkResult result = client_.WriteOne(FirstOf(slot) + push_.sequence_place, 0);
  if (result == LinkResult::kOk) gate_.Withdrawn(slot, clock_());
  return result;
}

LinkResult ModbusRobot::WritePoint(const PushPoint& point) {
  std::array<std::uint16_t, kMaxRegistersOfWrite> buffer{};
  const auto wanted = std::span(buffer).first(static_cast<std::size_t>(push_.stride));
  const PushFit fit = RegistersFromPush(push_, point, 0, wanted);
  LinkResult result = LinkResult::kPushRefused;
  if (fit == PushFit::kFits) {
    result = WriteSlot(point, wanted);
    if (result != LinkResult::kPushMismatch) return result;
  }
  if (const LinkResult withdrawn = Withdraw(point.slot); withdrawn != LinkResult::kOk)
    return withdrawn;
  const std::string_view reason = fit == PushFit::kFits
                                      ? "the registers read back differently from what was written"
                                      : FitText(fit);
  return Refuse(result, fmt::format("point {} in slot {} from register {}: {}", point.id,
                                    point.slot, FirstOf(point.slot), reason));
}

bool ModbusRobot::SamePoint(std::span<const std::uint16_t> a,
                            std::span<const std::uint16_t> b) const {
  if (push_.id_place) {
    const auto id = static_cast<std::size_t>(*push_.id_place);
    if (a[id] != b[id]) return false;
  }
  const int pose = push_.pose_place;
  return std::equal(a.begin() + pose, a.begin() + pose + PoseWordsOf(push_.type), b.begin() + pose);
}

LinkResult ModbusRobot::WriteSlot(const PushPoint& point, std::span<const std::uint16_t> wanted) {
  const int first = FirstOf(point.slot);
  const auto sequence_place = static_cast<std::size_t>(push_.sequence_place);
  std::array<std::uint16_t, kMaxRegistersOfWrite> buffer{};
  const auto found = std::span(buffer).first(wanted.size());
  const RegisterBlock slot{RegisterTable::kHolding, first, push_.stride};

  LinkResult result = client_.Read(slot, found);
  if (result != LinkResult::kOk) return result;
  std::uint16_t& sequence = slot_sequence_[static_cast<std::size_t>(point.slot)];
  if (sequence == 0) sequence = found[sequence_place];
  if (!SamePoint(found, wanted)) {
    result = client_.WriteOne(first + push_.sequence_place, 0);
    if (result == LinkResult::kOk && push_.id_place) {
      result = client_.WriteOne(first + *push_.id_place,
                                wanted[static_cast<std::size_t>(*push_.id_place)]);
    }
    if (result == LinkResult::kOk) {
      const int count = PoseWordsOf(push_.type);
      result = client_.Write(first + push_.pose_place,
                             wanted.subspan(static_cast<std::size_t>(push_.pose_place),
                                            static_cast<std::size_t>(count)));
    }
    if (result == LinkResult::kOk) result = client_.Read(slot, found);
    if (result != LinkResult::kOk) return result;
    if (!SamePoint(found, wanted) || found[sequence_place] != 0) return LinkResult::kPushMismatch;
  }
  const std::uint16_t next = SequenceAfter(sequence);
  result = client_.WriteOne(first + push_.sequence_place, next);
  if (result != LinkResult::kOk) return result;
  sequence = next;
  gate_.Written(point, clock_());
  return LinkResult::kOk;
}

}  // namespace plumbline::robot
