// Data model of the Modbus server: a read-only register image and a small writable command area.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace plumbline::modbus {

/// Set of readable addresses, without the gaps; built once and shared by all images.
class AddressRanges {
 public:
  struct Range {
    std::uint16_t first = 0, last = 0;  ///< inclusive, first <= last
  };

  /// Sorts the ranges and merges adjacent ones.
  explicit AddressRanges(std::vector<Range> ranges) {
    std::sort(ranges.begin(), ranges.end(),
              [](const Range& a, const Range& b) { return a.first < b.first; });
    for (const Range& range : ranges) {
      if (!ranges_.empty() && range.first <= ranges_.back().last + 1) {
        ranges_.back().last = std::max(ranges_.back().last, range.last);
      } else {
        ranges_.push_back(range);
      }
    }
  }

  /// True if all `count` addresses from `first` are readable.
  bool Contains(std::uint16_t first, int count) const {
    const auto after =
        std::upper_bound(ranges_.begin(), ranges_.end(), first,
                         [](std::uint16_t address, const Range& r) { return address < r.first; });
    return after != ranges_.begin() && first + count - 1 <= std::prev(after)->last;
  }

 private:
  std::vector<Range> ranges_;
};

/// Immutable snapshot. FC03 and FC04 read the registers, FC01 and FC02 the bits.
struct RegisterImage {
  std::shared_ptr<const AddressRanges> readable;  ///< register addresses
  std::vector<std::uint16_t> registers;           ///< by address, gaps included
  std::vector<std::uint8_t> bits;                 ///< by address, 0 or 1
};

/// Consecutive addresses that clients may write.
template <typename T>
struct WritableWindow {
  std::uint16_t first = 0;
  std::vector<T> values;

  bool Contains(std::uint16_t address, int count) const {
    return address >= first && address - first + count <= static_cast<int>(values.size());
  }
  T* At(std::uint16_t address) { return values.data() + (address - first); }
  const T* At(std::uint16_t address) const { return values.data() + (address - first); }
};

/// Registers and coils written by clients. Reads of these addresses are served from here, all
/// others from the image; one request cannot span both.
struct CommandArea {
  WritableWindow<std::uint16_t> registers;
  WritableWindow<std::uint8_t> coils;  ///< 0 or 1
  /// Registers that are not part of a command, such as a heartbeat: a client that writes only these
  /// does not count as a master.
  AddressRanges::Range non_command_registers{1, 0};
};

}  // namespace plumbline::modbus
