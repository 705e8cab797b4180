#include "drivers/modbus/tcp_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>

#include <cerrno>
#include <cstring>
#include <system_error>

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

Error CannotListen(const std::string& place, int reason) {
  std::string message =
      "cannot listen on " + place + ": " + std::generic_category().message(reason);
  if (reason == EACCES) message += " (ports below 1024 need CAP_NET_BIND_SERVICE)";
  if (reason == EADDRINUSE) message += " (another program holds the port; see ss -ltnp)";
  if (reason == EADDRNOTAVAIL) message += " (no interface of this machine has it; see ip address)";
  return Error{message};
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
  const std::string address = IpAddressText(client.address).data();
  const bool is_v6 = address.find(':') != std::string::npos;
  return (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(client.port);
}

Result<Descriptor> ListenOn(const std::string& address, int port) {
  const std::string place = address + " port " + std::to_string(port);
  if (port < 0 || port > 65535) {
    return Error{"cannot listen on " + place + ": the port is outside 0..65535"};
  }
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  const bool is_v4 = ::inet_pton(AF_INET, address.c_str(), &v4.sin_addr) == 1;
  if (!is_v4 && ::inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) != 1) {
    return Error{"cannot listen on " + place + ": neither an IPv4 nor an IPv6 address"};
  }
  v4.sin_family = AF_INET;
  v6.sin6_family = AF_INET6;
  v4.sin_port = v6.sin6_port = htons(static_cast<std::uint16_t>(port));
  Descriptor made(::socket(is_v4 ? AF_INET : AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int fd = made.get();
  if (!made) return CannotListen(place, errno);
  SetOption(fd, SOL_SOCKET, SO_REUSEADDR, 1);
  if (!is_v4) SetOption(fd, IPPROTO_IPV6, IPV6_V6ONLY, 0);
  const int bound = is_v4 ? ::bind(fd, reinterpret_cast<const sockaddr*>(&v4), sizeof v4)
                          : ::bind(fd, reinterpret_cast<const sockaddr*>(&v6), sizeof v6);
  if (bound == 0 && ::listen(fd, SOMAXCONN) == 0) return made;
  return CannotListen(place, errno);
}

int BoundPort(int fd) {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size);
  return PortOf(bound);
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
