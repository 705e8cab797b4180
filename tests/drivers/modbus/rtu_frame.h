// RTU frames for tests.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/modbus/adu.h"

namespace plumbline::modbus {

using Bytes = std::vector<std::uint8_t>;

/// PDU with address and checksum.
inline Bytes Rtu(std::uint8_t address, const Bytes& pdu) {
  std::array<std::uint8_t, kMaxRtuFrameBytes> frame;
  const std::size_t size = WriteRtuFrame(address, pdu, frame);
  return {frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)};
}

/// Concatenates two byte strings.
inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace plumbline::modbus
