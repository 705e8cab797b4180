#include "firmware-like/motion_offset/packet_sequence.h"

#include <algorithm>

namespace plumbline::motion_offset {
namespace {

/// Largest step from one packet to the next: IPOC is taken to count milliseconds at most 12 by 12,
/// with room for another unit.
constexpr std::uint32_t kLargestStep = 64;
/// How far back an old packet may be.
constexpr std::uint32_t kOldWindow = 1U << 16;

}  // namespace

bool PacketSequence::Follows(std::uint32_t from, std::uint32_t number) const {
  const std::uint32_t ahead = number - from;
  const std::uint32_t step = step_ != 0 ? step_ : kLargestStep;
  return ahead != 0 && ahead / step <= static_cast<std::uint32_t>(largest_gap_) + 1;
}

PacketSequence::Check PacketSequence::Next(std::uint64_t number) {
  const auto low = static_cast<std::uint32_t>(number);
  if (!last_) {
    last_ = low;
    return {};
  }
  const std::uint32_t ahead = low - *last_, behind = *last_ - low;
  if (ahead == 0) return {PacketOrder::kDuplicate};
  if (Follows(*last_, low)) {
    step_ = step_ == 0 ? ahead : std::min(step_, ahead);
    last_ = low;
    implausible_.reset();
    return {PacketOrder::kNew, ahead / step_ - 1};
  }
  if (implausible_ && Follows(*implausible_, low)) {
    last_ = low;
    implausible_.reset();
    return {PacketOrder::kRenumbered};
  }
  // An old packet never opens another sequence: a burst of late packets looks like one.
  if (behind <= kOldWindow) return {PacketOrder::kOld};
  implausible_ = low;
  return {PacketOrder::kImplausible};
}

}  // namespace plumbline::motion_offset
