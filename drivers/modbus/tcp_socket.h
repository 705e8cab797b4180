// Addresses and connections of the TCP server.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <string>

#include "drivers/modbus/client.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

Result<IpAddress> ParseIpAddress(const std::string& text);

/// Of a peer as accept() tells it.
IpAddress IpAddressFromSocket(const sockaddr_storage& peer);

/// As text, IPv4 in dots; no heap.
std::array<char, 46> IpAddressText(const IpAddress& address);

/// The port of a connection's other end; 0 where it has ended already.
std::uint16_t PeerPort(int fd);

/// No delay, keep-alive (a vanished client is noticed in 25 s), bounded kernel buffers.
void ConfigureClientSocket(int fd);

}  // namespace plumbline::modbus
