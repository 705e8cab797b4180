// Conversion between 16-bit registers and 32-bit values in the four word orders in use.
//
// libmodbus 3.1.6's own setters and getters are inconsistent with each other, so all conversions
// are done here.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace plumbline::modbus {

/// Order of the bytes A (most significant) to D (least significant) in two consecutive registers.
enum class WordOrder { kAbcd, kCdab, kBadc, kDcba };

/// Splits a 32-bit word into two registers in address order.
constexpr std::array<std::uint16_t, 2> RegistersFromU32(std::uint32_t value, WordOrder order) {
  auto high = static_cast<std::uint16_t>(value >> 16);
  auto low = static_cast<std::uint16_t>(value & 0xFFFF);
  if (order == WordOrder::kBadc || order == WordOrder::kDcba) {
    high = static_cast<std::uint16_t>((high >> 8) | (high << 8));
    low = static_cast<std::uint16_t>((low >> 8) | (low << 8));
  }
  if (order == WordOrder::kCdab || order == WordOrder::kDcba) return {low, high};
  return {high, low};
}

/// Joins two registers in address order into a 32-bit word.
constexpr std::uint32_t U32FromRegisters(std::uint16_t first, std::uint16_t second,
                                         WordOrder order) {
  if (order == WordOrder::kCdab || order == WordOrder::kDcba) {
    const std::uint16_t swap = first;
    first = second;
    second = swap;
  }
  if (order == WordOrder::kBadc || order == WordOrder::kDcba) {
    first = static_cast<std::uint16_t>((first >> 8) | (first << 8));
    second = static_cast<std::uint16_t>((second >> 8) | (second << 8));
  }
  return (static_cast<std::uint32_t>(first) << 16) | second;
}

constexpr std::array<std::uint16_t, 2> RegistersFromFloat(float value, WordOrder order) {
  return RegistersFromU32(std::bit_cast<std::uint32_t>(value), order);
}

constexpr float FloatFromRegisters(std::uint16_t first, std::uint16_t second, WordOrder order) {
  return std::bit_cast<float>(U32FromRegisters(first, second, order));
}

}  // namespace plumbline::modbus
