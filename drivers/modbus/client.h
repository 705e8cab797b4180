// Identity of a Modbus client.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace plumbline::modbus {

/// IPv6 address; IPv4 is mapped to ::ffff:a.b.c.d, so that a client has the same address on IPv4
/// and dual-stack sockets.
using IpAddress = std::array<std::uint8_t, 16>;

/// Remote end of a connection. The serial line, which has no addresses, is the default value.
struct Client {
  IpAddress address{};
  std::uint16_t port = 0;  ///< distinguishes connections from one address

  bool operator==(const Client&) const = default;
};

/// "192.168.0.5:49152", "[fe80::1]:49152" or "the serial line".
std::string TextOf(const Client& client);

}  // namespace plumbline::modbus
