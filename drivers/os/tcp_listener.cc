#include "drivers/os/tcp_listener.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace plumbline::os {
namespace {

Error CannotListen(const std::string& place, int reason, const char* if_privileged) {
  std::string message =
      "cannot listen on " + place + ": " + std::generic_category().message(reason);
  if (reason == EACCES) message += std::string(" (") + if_privileged + ")";
  if (reason == EADDRINUSE) message += " (another program uses the port; see ss -ltnp)";
  if (reason == EADDRNOTAVAIL)
    message += " (no interface of this machine has this address; see ip address)";
  return Error{message};
}

}  // namespace

std::string TcpEndpoint::Text() const {
  const bool is_v6 = address.find(':') != std::string::npos;
  return (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(port);
}

TcpEndpoint EndpointOf(const sockaddr_storage& end) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (end.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(end);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return {text.data(), ntohs(v4.sin_port)};
  }
  if (end.ss_family != AF_INET6) return {};
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(end);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) {
    inet_ntop(AF_INET, &v6.sin6_addr.s6_addr[12], text.data(), text.size());
  } else {
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  }
  return {text.data(), ntohs(v6.sin6_port)};
}

Result<TcpListener> TcpListener::Open(const std::string& address, int port,
                                      const char* if_privileged) {
  const std::string place = address + " port " + std::to_string(port);
  if (port < 0 || port > 65535) {
    return Error{"cannot listen on " + place + ": the port is outside 0..65535"};
  }
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  const bool is_v4 = inet_pton(AF_INET, address.c_str(), &v4.sin_addr) == 1;
  if (!is_v4 && inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) != 1) {
    return Error{"cannot listen on " + place + ": neither an IPv4 nor an IPv6 address"};
  }
  v4.sin_family = AF_INET;
  v6.sin6_family = AF_INET6;
  v4.sin_port = v6.sin6_port = htons(static_cast<std::uint16_t>(port));
  Descriptor made(socket(is_v4 ? AF_INET : AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int fd = made.get(), on = 1, off = 0;
  if (!made) return CannotListen(place, errno, if_privileged);
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!is_v4) setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
  const int bound = is_v4 ? bind(fd, reinterpret_cast<const sockaddr*>(&v4), sizeof v4)
                          : bind(fd, reinterpret_cast<const sockaddr*>(&v6), sizeof v6);
  if (bound != 0 || listen(fd, SOMAXCONN) != 0) return CannotListen(place, errno, if_privileged);
  return TcpListener(std::move(made));
}

TcpListener::TcpListener(Descriptor socket) : socket_(std::move(socket)) {
  fcntl(fd(), F_SETFL, fcntl(fd(), F_GETFL) | O_NONBLOCK);
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  getsockname(fd(), reinterpret_cast<sockaddr*>(&bound), &size);
  endpoint_ = EndpointOf(bound);
}

Descriptor TcpListener::Accept(sockaddr_storage& peer) const {
  socklen_t size = sizeof peer;
  return Descriptor(
      accept4(fd(), reinterpret_cast<sockaddr*>(&peer), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

}  // namespace plumbline::os
