// UDP socket of the controller's side.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

namespace motion_robots {

class UdpPeer {
 public:
  /// Bound to a free port of this IPv4 address.
  explicit UdpPeer(const char* address = "127.0.0.1")
      : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in own = Address(address, 0);
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own) != 0) std::abort();
  }
  ~UdpPeer() { close(socket_); }
  UdpPeer(const UdpPeer&) = delete;
  UdpPeer& operator=(const UdpPeer&) = delete;

  void Send(const std::string& bytes, int port) const {
    const sockaddr_in to = Address("127.0.0.1", port);
    sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof to);
  }
  /// Empty if nothing arrives within that time.
  std::string Receive(int timeout_ms) const {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, timeout_ms) <= 0) return "";
    std::string bytes(2048, '\0');
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return bytes;
  }
  int port() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &size);
    return ntohs(own.sin_port);
  }

  /// A port that is free now.
  static int FreePort() { return UdpPeer().port(); }

 private:
  static sockaddr_in Address(const char* address, int port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, address, &at.sin_addr);
    return at;
  }

  int socket_;
};

}  // namespace motion_robots
