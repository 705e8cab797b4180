#include "drivers/robot/codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "drivers/robot/reported_rotation.h"

namespace plumbline::robot {
namespace {

constexpr std::size_t kMaxMarkers = 6;

bool IsBits(const RegisterBlock& block) {
  return block.table == RegisterTable::kCoil || block.table == RegisterTable::kDiscrete;
}

/// Byte count of the response.
int ResponseBytes(const RegisterBlock& block) {
  return IsBits(block) ? (block.count + 7) / 8 : 2 * block.count;
}

/// True if a serial line cannot tell the responses apart, except by their contents.
bool LookAlike(const RegisterBlock& a, const RegisterBlock& b) {
  return a.table == b.table && ResponseBytes(a) == ResponseBytes(b);
}

bool LooksLikeAny(const RegisterBlock& block, const std::vector<RegisterBlock>& others) {
  return std::any_of(others.begin(), others.end(),
                     [&block](const RegisterBlock& other) { return LookAlike(block, other); });
}

std::vector<RegisterBlock> SlotReads(const RobotProfile& profile, bool push) {
  if (!push || !profile.push) return {};
  return {{RegisterTable::kHolding, profile.push->first, profile.push->stride}};
}

/// True if joints and load, which must be of one instant, lie in more than one block.
bool IsSplit(const RobotProfile& profile) {
  std::vector<RegisterValue> values;
  for (const JointSignal& joint : profile.joints) {
    values.push_back(joint.value);
    if (joint.wrap == JointWrap::kRevolutions) values.push_back(joint.revolutions);
  }
  for (const auto& value : {profile.payload_mass, profile.tool_number, profile.payload_item}) {
    if (value) values.push_back(*value);
  }
  if (profile.payload_cog) {
    values.insert(values.end(), profile.payload_cog->begin(), profile.payload_cog->end());
  }
  return !values.empty() && std::any_of(values.begin(), values.end(), [&](const auto& value) {
    return BlockOf(profile.blocks, value) != BlockOf(profile.blocks, values.front());
  });
}

/// A read of `count` registers inside `block` that contains `value`, if there is one.
RegisterBlock Marker(const RegisterBlock& block, int count,
                     const std::optional<RegisterValue>& value) {
  const int last_start = block.first + block.count - count;
  return {block.table, value ? std::min(value->address, last_start) : block.first, count};
}

/// Markers inside `block`, even counts first: a controller may refuse to read half of a 32-bit
/// value.
void AddMarkers(const RegisterBlock& block, const std::optional<RegisterValue>& value,
                const std::vector<RegisterBlock>& taken, std::vector<RegisterBlock>& markers) {
  for (const int start : {2, 1}) {
    for (int count = start; count < block.count && markers.size() < kMaxMarkers; count += 2) {
      if (value && count < WordsOf(value->type)) continue;
      const RegisterBlock marker = Marker(block, count, value);
      if (LooksLikeAny(marker, taken) || LooksLikeAny(marker, markers)) continue;
      markers.push_back(marker);
    }
  }
}

}  // namespace

ReadPlan PlanReading(const RobotProfile& profile, bool serial, bool push) {
  ReadPlan plan;
  std::size_t place = 0;
  for (const RegisterBlock& block : profile.blocks) {
    plan.steps.push_back({block, place});
    place += static_cast<std::size_t>(block.count);
  }
  plan.compares_refresh = profile.sequence && IsSplit(profile);
  const auto counter =
      plan.compares_refresh ? BlockOf(profile.blocks, *profile.sequence) : std::nullopt;
  if (counter) {
    const auto first = plan.steps.begin() + static_cast<std::ptrdiff_t>(*counter);
    std::rotate(plan.steps.begin(), first, first + 1);
  }
  if (!serial) {
    if (counter) {
      const RegisterValue& value = *profile.sequence;
      plan.markers.push_back({value.table, value.address, WordsOf(value.type)});
    }
    return plan;
  }
  std::vector<RegisterBlock> taken = SlotReads(profile, push);
  taken.insert(taken.end(), profile.blocks.begin(), profile.blocks.end());
  for (std::size_t k = 0; k < profile.blocks.size(); ++k) {
    if (counter && k != *counter) continue;
    AddMarkers(profile.blocks[k], counter ? profile.sequence : std::nullopt, taken, plan.markers);
  }
  return plan;
}

std::optional<std::string> SerialFault(const RobotProfile& profile, bool push) {
  const std::vector<RegisterBlock> slots = SlotReads(profile, push);
  for (std::size_t k = 0; k < profile.blocks.size(); ++k) {
    const RegisterBlock& block = profile.blocks[k];
    const auto same = std::find_if(profile.blocks.begin(),
                                   profile.blocks.begin() + static_cast<std::ptrdiff_t>(k),
                                   [&](const auto& other) { return LookAlike(block, other); });
    const bool alike = same != profile.blocks.begin() + static_cast<std::ptrdiff_t>(k);
    if (!alike && !LooksLikeAny(block, slots)) continue;
    return fmt::format(
        "reads {} registers from {} and {} from {}{}: on a serial line their responses cannot be "
        "told apart, so that one may be taken for the other; {} in one of the [[read]], or use one "
        "[[read]] for both",
        block.count, block.first, alike ? same->count : slots.front().count,
        alike ? same->first : slots.front().first, alike ? "" : " (a push slot)",
        IsBits(block) ? "read 8 coils more" : "read one register more or less");
  }
  if (!PlanReading(profile, true, push).markers.empty()) return std::nullopt;
  return fmt::format(
      "has no room for a second, shorter read{}, without which a late response on a serial line is "
      "taken for the next one; read at least 2 registers more {}",
      profile.sequence && IsSplit(profile) ? " of the refresh counter" : "",
      profile.sequence && IsSplit(profile) ? "in the [[read]] of [sequence]" : "in a [[read]]");
}

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

bool Holds(const RegisterBlock& block, RegisterTable table, int address, int words) {
  return block.table == table && address >= block.first &&
         address + words <= block.first + block.count;
}

bool IsInteger(RegisterType type) {
  return type != RegisterType::kFloat32;
}

/// All register values of a profile with their names for error messages.
std::vector<std::pair<std::string, RegisterValue>> NamedValues(const RobotProfile& profile) {
  std::vector<std::pair<std::string, RegisterValue>> values;
  for (std::size_t i = 0; i < profile.joints.size(); ++i) {
    values.emplace_back(fmt::format("joint {}", i + 1), profile.joints[i].value);
    if (profile.joints[i].wrap == JointWrap::kRevolutions) {
      values.emplace_back(fmt::format("revolutions of joint {}", i + 1),
                          profile.joints[i].revolutions);
    }
  }
  const auto add_pose = [&values](const std::string& name, const std::optional<PoseSignal>& pose) {
    if (!pose) return;
    for (const RegisterValue& value : pose->position) values.emplace_back(name, value);
    for (const RegisterValue& value : pose->orientation) values.emplace_back(name, value);
  };
  add_pose("tcp", profile.tcp);
  add_pose("tool offset", profile.tool_offset);
  if (profile.payload_mass) values.emplace_back("payload mass", *profile.payload_mass);
  if (profile.payload_cog) {
    for (const RegisterValue& value : *profile.payload_cog) {
      values.emplace_back("payload centre of gravity", value);
    }
  }
  for (const RegisterValue& value : profile.temperatures) values.emplace_back("temperature", value);
  if (profile.tool_number) values.emplace_back("tool number", *profile.tool_number);
  if (profile.payload_item) values.emplace_back("payload item", *profile.payload_item);
  if (profile.sequence) values.emplace_back("sequence", *profile.sequence);
  if (profile.mode.value) values.emplace_back("mode", *profile.mode.value);
  for (const ModeSignal::Bit& bit : profile.mode.bits) {
    RegisterValue value;
    value.table = bit.table;
    value.address = bit.address;
    values.emplace_back("mode bit", value);
  }
  return values;
}

std::optional<std::string> FaultOf(const RobotProfile& profile) {
  if (profile.joints.empty() || profile.joints.size() > model::kMaxJoints) {
    return fmt::format("{} joints; must be 1..{}", profile.joints.size(), model::kMaxJoints);
  }
  for (const RegisterBlock& block : profile.blocks) {
    if (block.count < 1 || block.count > kMaxRegistersOfRead || block.first < 0 ||
        block.first + block.count > 65536) {
      return fmt::format("block of {} registers from {}: must have 1..{} registers within 0..65535",
                         block.count, block.first, kMaxRegistersOfRead);
    }
  }
  for (const auto& [name, value] : NamedValues(profile)) {
    if (!IsRead(profile.blocks, value)) {
      return fmt::format("{} at {} is not inside any of the blocks", name, value.address);
    }
    if (!std::isfinite(value.scale) || value.scale == 0 || !std::isfinite(value.offset)) {
      return fmt::format("{} at {}: scale {} and offset {} must be finite and the scale not 0",
                         name, value.address, value.scale, value.offset);
    }
  }
  for (const auto& counted :
       {profile.tool_number, profile.payload_item, profile.sequence, profile.mode.value}) {
    if (counted && !IsInteger(counted->type)) {
      return fmt::format("the value at {} must have an integer type", counted->address);
    }
  }
  for (const ModeSignal::Bit& bit : profile.mode.bits) {
    if (bit.bit < 0 || bit.bit > 15) return fmt::format("mode bit {} is not 0..15", bit.bit);
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::size_t> BlockOf(const std::vector<RegisterBlock>& blocks,
                                   const RegisterValue& value) {
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    if (Holds(blocks[k], value.table, value.address, WordsOf(value.type))) return k;
  }
  return std::nullopt;
}

bool IsRead(const std::vector<RegisterBlock>& blocks, const RegisterValue& value) {
  return BlockOf(blocks, value).has_value();
}

Result<RobotCodec> RobotCodec::Create(const RobotProfile& profile) {
  if (const auto fault = FaultOf(profile)) {
    return Error{fmt::format("robot profile \"{}\": {}", profile.name, *fault)};
  }
  RobotCodec codec;
  codec.blocks_ = profile.blocks;
  for (const RegisterBlock& block : profile.blocks) codec.word_count_ += block.count;
  for (const JointSignal& joint : profile.joints) {
    JointField field{codec.Compile(joint.value), joint.wrap, {}};
    if (joint.wrap == JointWrap::kRevolutions) field.revolutions = codec.Compile(joint.revolutions);
    codec.joints_.push_back(field);
    if (IsInteger(joint.value.type)) {
      codec.q_resolution_ = std::max(codec.q_resolution_, std::abs(joint.value.scale));
    }
  }
  if (profile.tcp) codec.tcp_ = codec.Compile(*profile.tcp);
  if (profile.tool_offset) codec.tool_offset_ = codec.Compile(*profile.tool_offset);
  codec.tcp_is_flange_ = profile.tcp_is_flange;
  if (profile.payload_mass) codec.payload_mass_ = codec.Compile(*profile.payload_mass);
  if (profile.payload_cog) {
    const std::array<RegisterValue, 3>& cog = *profile.payload_cog;
    codec.payload_cog_ = {codec.Compile(cog[0]), codec.Compile(cog[1]), codec.Compile(cog[2])};
  }
  for (const RegisterValue& value : profile.temperatures) {
    codec.temperatures_.push_back(codec.Compile(value));
  }
  codec.hottest_joint_ = profile.hottest_joint;
  if (profile.tool_number) codec.tool_number_ = codec.Compile(*profile.tool_number);
  if (profile.payload_item) codec.payload_item_ = codec.Compile(*profile.payload_item);
  if (profile.sequence) {
    codec.sequence_ = codec.Compile(*profile.sequence);
    codec.sequence_address_ = profile.sequence->address;
  }
  if (profile.mode.value) codec.mode_value_ = codec.Compile(*profile.mode.value);
  for (const ModeSignal::Bit& bit : profile.mode.bits) {
    codec.mode_bits_.push_back(
        {codec.IndexOf(bit.table, bit.address), bit.bit, bit.when, bit.mode});
  }
  codec.meanings_ = profile.mode.meanings;
  return codec;
}

int RobotCodec::IndexOf(RegisterTable table, int address) const {
  int index = 0;
  for (const RegisterBlock& block : blocks_) {
    if (Holds(block, table, address, 1)) return index + address - block.first;
    index += block.count;
  }
  return 0;
}

RobotCodec::Field RobotCodec::Compile(const RegisterValue& value) const {
  int index = 0;
  for (const RegisterBlock& block : blocks_) {
    if (Holds(block, value.table, value.address, WordsOf(value.type))) {
      index += value.address - block.first;
      break;
    }
    index += block.count;
  }
  return {index, value.type, value.order, value.scale, value.offset};
}

RobotCodec::PoseField RobotCodec::Compile(const PoseSignal& signal) const {
  PoseField field;
  for (std::size_t i = 0; i < 3; ++i) {
    field.position[i] = Compile(signal.position[i]);
    field.orientation[i] = Compile(signal.orientation[i]);
  }
  field.convention = signal.convention;
  return field;
}

double RobotCodec::Raw(const Field& field, Words words) {
  const auto index = static_cast<std::size_t>(field.index);
  const std::uint16_t first = words[index];
  switch (field.type) {
    case RegisterType::kInt16:
      return static_cast<std::int16_t>(first);
    case RegisterType::kUint16:
      return first;
    case RegisterType::kInt32:
      return static_cast<std::int32_t>(
          modbus::U32FromRegisters(first, words[index + 1], field.order));
    case RegisterType::kUint32:
      return modbus::U32FromRegisters(first, words[index + 1], field.order);
    case RegisterType::kFloat32:
      break;
  }
  return static_cast<double>(modbus::FloatFromRegisters(first, words[index + 1], field.order));
}

double RobotCodec::Value(const Field& field, Words words) {
  return field.scale * Raw(field, words) + field.offset;
}

double RobotCodec::JointValue(const JointField& joint, Words words) {
  const double value = Value(joint.value, words);
  if (joint.wrap == JointWrap::kPi) return value > std::numbers::pi ? value - kTurn : value;
  if (joint.wrap == JointWrap::kRevolutions) return value + kTurn * Value(joint.revolutions, words);
  return value;
}

Pose RobotCodec::PoseValue(const PoseField& pose, Words words) {
  Vec3 position;
  Vec3 angles;
  for (int i = 0; i < 3; ++i) {
    position[i] = Value(pose.position[static_cast<std::size_t>(i)], words);
    angles[i] = Value(pose.orientation[static_cast<std::size_t>(i)], words);
  }
  return {RotationFromReported(angles, pose.convention), position};
}

double RobotCodec::Temperature(Words words) const {
  double sum = 0;
  double largest = -std::numeric_limits<double>::infinity();
  for (const Field& field : temperatures_) {
    const double value = Value(field, words);
    sum += value;
    largest = std::max(largest, value);
  }
  if (!std::isfinite(sum)) return sum;  // do not hide an invalid sensor in the mean
  return hottest_joint_ ? largest : sum / static_cast<double>(temperatures_.size());
}

model::RobotMode RobotCodec::Mode(Words words) const {
  for (const BitField& field : mode_bits_) {
    const bool set = ((words[static_cast<std::size_t>(field.index)] >> field.bit) & 1) != 0;
    if (set == field.when) return field.mode;
  }
  if (!mode_value_) return model::RobotMode::kUnknown;
  const double raw = Raw(*mode_value_, words);
  for (const ModeSignal::Meaning& meaning : meanings_) {
    if (static_cast<double>(meaning.value) == raw) return meaning.mode;
  }
  return model::RobotMode::kUnknown;
}

void RobotCodec::RobotStateFromRegisters(Words words, model::RobotState& state) const {
  state.q.resize(joint_count());
  for (int i = 0; i < joint_count(); ++i) {
    state.q[i] = JointValue(joints_[static_cast<std::size_t>(i)], words);
  }
  state.q_resolution = q_resolution_;
  state.X_BT.reset();
  if (tcp_) state.X_BT = PoseValue(*tcp_, words);
  state.tcp_is_flange = tcp_is_flange_;
  state.X_FT.reset();
  if (tool_offset_) state.X_FT = PoseValue(*tool_offset_, words);
  state.payload_kg.reset();
  if (payload_mass_) state.payload_kg = Value(*payload_mass_, words);
  state.payload_cog_F.reset();
  if (payload_cog_) {
    state.payload_cog_F = Vec3(Value((*payload_cog_)[0], words), Value((*payload_cog_)[1], words),
                               Value((*payload_cog_)[2], words));
  }
  state.temp_C.reset();
  if (!temperatures_.empty()) state.temp_C = Temperature(words);
  const auto number = [&](const std::optional<Field>& field) -> std::optional<int> {
    constexpr double kLargest = std::numeric_limits<int>::max();
    if (!field) return std::nullopt;
    return static_cast<int>(std::clamp(Value(*field, words), -kLargest, kLargest));
  };
  state.tool_number = number(tool_number_);
  state.payload_item = number(payload_item_);
  state.mode = Mode(words);
}

std::optional<std::uint32_t> RobotCodec::RefreshCounter(Words words) const {
  if (!sequence_) return std::nullopt;
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(Raw(*sequence_, words)));
}

std::optional<std::uint32_t> RobotCodec::RefreshCounter(Words words,
                                                        const RegisterBlock& block) const {
  if (!sequence_) return std::nullopt;
  Field field = *sequence_;
  field.index = sequence_address_ - block.first;
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(Raw(field, words)));
}

}  // namespace plumbline::robot
