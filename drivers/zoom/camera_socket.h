// Sockets to a VISCA camera in the network.
#pragma once

#include <sys/socket.h>

#include <memory>
#include <string>

#include "drivers/os/descriptor.h"
#include "drivers/zoom/visca_address.h"

namespace plumbline::zoom {

/// Host of a camera. A name is looked up in a thread of its own, because a name server that does
/// not answer blocks for longer than any timeout of a reading.
class CameraHost {
 public:
  explicit CameraHost(visca::Address address) : address_(std::move(address)) {}

  /// Opens a non-blocking socket connected to the camera; a TCP connection may still be pending.
  /// @param wait_s   longest wait for a name server
  /// @param problem  receives the reason of a failure, with its remedy
  bool Connect(double wait_s, os::Descriptor& fd, std::string& problem);

 private:
  struct Lookup;
  bool Find(double wait_s, sockaddr_storage& found, socklen_t& size, std::string& problem);

  const visca::Address address_;
  std::shared_ptr<Lookup> pending_;
};

/// Reason and remedy of a failed network call.
/// @param error  its errno
std::string NetworkErrorText(int error, const visca::Address& address);

}  // namespace plumbline::zoom
