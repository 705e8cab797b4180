// Sockets to a VISCA camera in the network.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/os/descriptor.h"
#include "drivers/os/host_addresses.h"
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

  /// The camera is not at the address that Connect() used: the next call uses the next one.
  /// @return  false after the last address of the name; the next call starts with the first again
  bool TryNext();

  /// Reason and remedy of a failed network call. @param error  its errno
  std::string ErrorText(int error) const;

 private:
  struct Lookup;
  bool Find(double wait_s, std::string& problem);

  const visca::Address address_;
  std::shared_ptr<Lookup> pending_;
  std::vector<os::HostAddress> found_;  ///< kept until all have been tried
  std::size_t next_ = 0;                ///< of them
};

}  // namespace plumbline::zoom
