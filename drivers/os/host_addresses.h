// Addresses of a host, by its name or number.
#pragma once

#include <sys/socket.h>

#include <string>
#include <vector>

namespace plumbline::os {

struct HostAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;

  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  /// "192.168.1.9" or "fe80::1": without port and interface.
  std::string Text() const;
};

struct HostAddresses {
  int error = 0;                  ///< of getaddrinfo(), for gai_strerror()
  std::vector<HostAddress> list;  ///< in the order in which to try them; empty after an error
};

enum class HostForm {
  kNumeric,  ///< no name server is asked
  kAny,      ///< may block on a name server
};

HostAddresses FindHost(const std::string& host, int port, HostForm form);

}  // namespace plumbline::os
