// Sequence check of a controller's packets: which are new, and how many were lost before them.
#pragma once

#include <cstdint>
#include <optional>

namespace plumbline::motion_offset {

enum class PacketOrder : std::uint8_t {
  kNew,          ///< follows the last new one, possibly after lost ones
  kDuplicate,    ///< the same number as the last new one
  kOld,          ///< an earlier number: reordered on the way
  kImplausible,  ///< too far from the last one to follow it; a single such packet changes nothing
  kRenumbered,   ///< the second packet in a row that continues an implausible one: another sequence
};

/// Compares numbers modulo 2^32: an EGM number is a uint32 and wraps there. The step from one
/// packet to the next is the smallest one seen (1 with EGM; IPOC counts in steps that depend on the
/// cycle). Values in, values out; does not allocate.
class PacketSequence {
 public:
  /// @param largest_gap  packets in a row that may be lost, so that the next one still follows
  explicit PacketSequence(int largest_gap) : largest_gap_(largest_gap) {}

  struct Check {
    PacketOrder order = PacketOrder::kNew;
    std::uint32_t lost = 0;  ///< before this packet, if it is new
  };
  Check Next(std::uint64_t number);
  void Restart() { *this = PacketSequence(largest_gap_); }

 private:
  bool Follows(std::uint32_t from, std::uint32_t number) const;

  int largest_gap_;
  std::optional<std::uint32_t> last_;
  std::uint32_t step_ = 0;  ///< 0: not known yet
  std::optional<std::uint32_t> implausible_;
};

}  // namespace plumbline::motion_offset
