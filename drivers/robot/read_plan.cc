#include "drivers/robot/read_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/robot/codec.h"

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

}  // namespace plumbline::robot
