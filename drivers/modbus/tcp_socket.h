// Addresses and the listening socket of the TCP server.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <string>

#include "drivers/modbus/client.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::modbus {

Result<IpAddress> ParseIpAddress(const std::string& text);

/// Of a peer as accept() tells it.
IpAddress IpAddressFromSocket(const sockaddr_storage& peer);

/// As text, IPv4 in dots; no heap.
std::array<char, 46> IpAddressText(const IpAddress& address);

/// An open listening socket. @return or why not, with a remedy
/// @param address  IPv4 or IPv6; "::" takes both
/// @param port     0: the kernel chooses
Result<Descriptor> ListenOn(const std::string& address, int port);

/// The port a socket is bound to.
int BoundPort(int fd);

/// The port of a connection's other end; 0 where it has ended already.
std::uint16_t PeerPort(int fd);

/// No delay, keep-alive (a vanished client is noticed in 25 s), bounded kernel buffers.
void ConfigureClientSocket(int fd);

}  // namespace plumbline::modbus
