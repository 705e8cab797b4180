// Listening TCP socket, of this process's own or inherited.
#pragma once

#include <sys/socket.h>

#include <string>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline {

/// One end of a TCP connection.
struct TcpEndpoint {
  std::string address;  ///< "192.168.0.3", "fe80::1"; empty: none of TCP
  int port = 0;

  std::string Text() const;  ///< "192.168.0.3:8080", "[fe80::1]:8080"
};

/// Of an address as accept() and getsockname() report it; IPv4 in dots, through an IPv6 socket too.
TcpEndpoint EndpointOf(const sockaddr_storage& end);

/// Never blocks. Clients that come while nobody accepts wait in the kernel's queue.
class TcpListener {
 public:
  /// @param address        IPv4 or IPv6; "::" takes both
  /// @param port           0: the kernel chooses
  /// @param if_privileged  what to do where the port needs a right that this process has not
  /// @return               or why not, with a remedy
  static Result<TcpListener> Open(const std::string& address, int port,
                                  const char* if_privileged =
                                      "ports below 1024 need "
                                      "CAP_NET_BIND_SERVICE");
  /// Of a socket that listens already: a service manager's.
  explicit TcpListener(Descriptor socket);

  int fd() const { return socket_.get(); }
  const TcpEndpoint& endpoint() const { return endpoint_; }

  /// The next client's connection, which does not block; no heap. @param peer  its address
  /// @return none, errno says why: EAGAIN where nobody waits
  Descriptor Accept(sockaddr_storage& peer) const;

 private:
  Descriptor socket_;
  TcpEndpoint endpoint_;
};

}  // namespace plumbline
