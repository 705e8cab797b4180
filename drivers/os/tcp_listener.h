// Listening TCP socket, opened by this process or inherited.
#pragma once

#include <sys/socket.h>

#include <string>

#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::os {

/// One end of a TCP connection.
struct TcpEndpoint {
  std::string address;  ///< "192.168.0.3", "fe80::1"; empty if not a TCP address
  int port = 0;

  std::string Text() const;  ///< "192.168.0.3:8080", "[fe80::1]:8080"
};

/// Converts an address from accept() or getsockname(); IPv4 in dotted notation, also if it arrived
/// through an IPv6 socket.
TcpEndpoint EndpointOf(const sockaddr_storage& end);

/// Non-blocking listener. Clients that connect between two Accept() calls wait in the kernel's
/// queue.
class TcpListener {
 public:
  /// @param address        IPv4 or IPv6; "::" accepts both
  /// @param port           if 0, the kernel chooses one
  /// @param if_privileged  remedy if the port needs a privilege that this process lacks
  /// @return               why it cannot listen, with a remedy
  static Result<TcpListener> Open(const std::string& address, int port,
                                  const char* if_privileged =
                                      "ports below 1024 need "
                                      "CAP_NET_BIND_SERVICE");
  /// Takes a socket that is already listening, from the service manager.
  explicit TcpListener(Descriptor socket);

  int fd() const { return socket_.get(); }
  const TcpEndpoint& endpoint() const { return endpoint_; }

  /// Accepts the next connection, which is non-blocking; allocates nothing.
  /// @param peer  receives the client's address
  /// @return  an empty descriptor with errno set on failure: EAGAIN if no client is waiting
  Descriptor Accept(sockaddr_storage& peer) const;

 private:
  Descriptor socket_;
  TcpEndpoint endpoint_;
};

}  // namespace plumbline::os
