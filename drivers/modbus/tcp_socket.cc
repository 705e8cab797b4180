#include "drivers/modbus/tcp_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>

#include <cstring>

#include "drivers/os/tcp_listener.h"

namespace plumbline::modbus {
namespace {

constexpr int kSocketBufferBytes = 32 * 1024;

void SetOption(int fd, int level, int name, int value) {
  ::setsockopt(fd, level, name, &value, sizeof value);
}

IpAddress MappedFromV4(const in_addr& v4) {
  IpAddress address{};
  address[10] = address[11] = 0xFF;
  std::memcpy(address.data() + 12, &v4, 4);
  return address;
}

std::uint16_t PortOf(const sockaddr_storage& end) {
  return ntohs(end.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(end).sin6_port
                                         : reinterpret_cast<const sockaddr_in&>(end).sin_port);
}

}  // namespace

Result<IpAddress> ParseIpAddress(const std::string& text) {
  IpAddress address{};
  if (::inet_pton(AF_INET6, text.c_str(), address.data()) == 1) return address;
  in_addr v4{};
  if (::inet_pton(AF_INET, text.c_str(), &v4) == 1) return MappedFromV4(v4);
  return Error{"\"" + text + "\" is neither an IPv4 nor an IPv6 address"};
}

IpAddress IpAddressFromSocket(const sockaddr_storage& peer) {
  if (peer.ss_family == AF_INET) {
    return MappedFromV4(reinterpret_cast<const sockaddr_in&>(peer).sin_addr);
  }
  IpAddress address{};
  if (peer.ss_family == AF_INET6) {
    std::memcpy(address.data(), &reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr, 16);
  }
  return address;
}

std::array<char, 46> IpAddressText(const IpAddress& address) {
  std::array<char, 46> text{};
  in_addr v4{};
  std::memcpy(&v4, address.data() + 12, 4);
  if (MappedFromV4(v4) == address) {
    ::inet_ntop(AF_INET, &v4, text.data(), text.size());
  } else {
    ::inet_ntop(AF_INET6, address.data(), text.data(), text.size());
  }
  return text;
}

std::string TextOf(const Client& client) {
  if (client == Client()) return "the serial line";
  return os::TcpEndpoint{IpAddressText(client.address).data(), client.port}.Text();
}

std::uint16_t PeerPort(int fd) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size);
  return PortOf(peer);
}

void ConfigureClientSocket(int fd) {
  SetOption(fd, IPPROTO_TCP, TCP_NODELAY, 1);
  SetOption(fd, SOL_SOCKET, SO_SNDBUF, kSocketBufferBytes);
  SetOption(fd, SOL_SOCKET, SO_RCVBUF, kSocketBufferBytes);
  SetOption(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPIDLE, 10);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPINTVL, 5);
  SetOption(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
}

}  // namespace plumbline::modbus
