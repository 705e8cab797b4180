// Where a VISCA camera is reached: a serial line, or an address in the network. Pure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

namespace plumbline::visca {

enum class Transport : std::uint8_t {
  kSerial,
  kUdp,  ///< VISCA over IP, with header and sequence number
  kTcp,  ///< packets as on a serial line
};

struct Address {
  Transport transport = Transport::kSerial;
  std::string host;  ///< for kSerial: the device file
  int port = 0;

  std::string Text() const;  ///< "/dev/ttyUSB0", "udp://192.168.1.9:52381", "tcp://[fe80::1]:5678"
};

/// @param device     a path, or an address: "192.168.1.9", "camera.local:52381", "[fe80::1]:5678",
///                   "tcp://192.168.1.9"
/// @param transport  "serial", "udp" or "tcp"; empty: as `device` says, UDP for an address
/// @return           what is wrong, without the value
Result<Address> AddressFrom(std::string_view device, std::string_view transport);

}  // namespace plumbline::visca
