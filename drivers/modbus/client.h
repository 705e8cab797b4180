// Who makes a request.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace plumbline::modbus {

/// IPv6, or IPv4 as ::ffff:a.b.c.d, so that a client has one address on every kind of socket.
using IpAddress = std::array<std::uint8_t, 16>;

/// A connection's other end. The serial line, which has no addresses, is the empty one.
struct Client {
  IpAddress address{};
  std::uint16_t port = 0;  ///< differs between two open connections of one address

  bool operator==(const Client&) const = default;
};

/// "192.168.0.5:49152", "[fe80::1]:49152" or "the serial line".
std::string TextOf(const Client& client);

}  // namespace plumbline::modbus
