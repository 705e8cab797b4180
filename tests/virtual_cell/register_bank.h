// A block of Modbus registers with typed access; 32-bit values high word first (ABCD).
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace virtual_cell {

class RegisterBank {
 public:
  explicit RegisterBank(int size) : words_(static_cast<std::size_t>(size)) {}

  std::uint16_t* data() { return words_.data(); }
  int size() const { return static_cast<int>(words_.size()); }

  std::uint16_t Word(int at) const { return words_[static_cast<std::size_t>(at)]; }
  void SetWord(int at, int value) {
    words_[static_cast<std::size_t>(at)] = static_cast<std::uint16_t>(value & 0xFFFF);
  }
  /// Rounded and saturated to a signed 16-bit register.
  void SetSigned(int at, double value) {
    const double limited = value < -32768 ? -32768 : value > 32767 ? 32767 : value;
    SetWord(at, std::isfinite(value) ? static_cast<int>(std::lround(limited)) : -32768);
  }
  std::uint32_t Long(int at) const {
    return (static_cast<std::uint32_t>(Word(at)) << 16) | Word(at + 1);
  }
  void SetLong(int at, std::uint32_t value) {
    SetWord(at, static_cast<int>(value >> 16));
    SetWord(at + 1, static_cast<int>(value & 0xFFFF));
  }
  float Float(int at) const { return std::bit_cast<float>(Long(at)); }
  void SetFloat(int at, double value) {
    SetLong(at, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  }

 private:
  std::vector<std::uint16_t> words_;
};

}  // namespace virtual_cell
