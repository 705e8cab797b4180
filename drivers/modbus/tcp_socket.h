// Socket addresses and options of the TCP server.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <string>

#include "drivers/modbus/client.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

Result<IpAddress> ParseIpAddress(const std::string& text);

/// Address of a peer as returned by accept().
IpAddress IpAddressFromSocket(const sockaddr_storage& peer);

/// Text of an address, IPv4 in dotted form; allocates nothing.
std::array<char, 46> IpAddressText(const IpAddress& address);

/// Port of the remote end of a connection; 0 if it has already been closed.
std::uint16_t PeerPort(int fd);

/// Sets TCP_NODELAY, keep-alive (a vanished client is detected within 25 s) and bounded kernel
/// buffers.
void ConfigureClientSocket(int fd);

}  // namespace plumbline::modbus
