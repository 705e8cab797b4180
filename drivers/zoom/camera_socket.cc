#include "drivers/zoom/camera_socket.h"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace plumbline::zoom {
namespace {

using visca::Transport;

std::string ErrnoText(int error) {
  return std::generic_category().message(error);
}

/// @param flags  of getaddrinfo(): AI_NUMERICHOST asks no name server
/// @return       0, or an error of getaddrinfo()
int FindAddress(const visca::Address& address, int flags, sockaddr_storage& found,
                socklen_t& size) {
  addrinfo hints{};
  hints.ai_flags = flags | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;  // one row for each address; the type is not used
  addrinfo* list = nullptr;
  const std::string port = std::to_string(address.port);
  const int error = getaddrinfo(address.host.c_str(), port.c_str(), &hints, &list);
  if (error != 0) return error;
  size = list->ai_addrlen;
  std::memcpy(&found, list->ai_addr, size);
  freeaddrinfo(list);
  return 0;
}

}  // namespace

/// Shared with the thread, which may outlive the sensor.
struct CameraHost::Lookup {
  std::mutex mutex;  ///< guards the rest
  std::condition_variable finished;
  bool done = false;
  int error = 0;
  sockaddr_storage address{};
  socklen_t size = 0;
};

bool CameraHost::Find(double wait_s, sockaddr_storage& found, socklen_t& size,
                      std::string& problem) {
  if (FindAddress(address_, AI_NUMERICHOST, found, size) == 0) return true;
  if (!pending_) {
    pending_ = std::make_shared<Lookup>();
    std::thread([lookup = pending_, address = address_] {
      sockaddr_storage answer{};
      socklen_t length = 0;
      const int error = FindAddress(address, 0, answer, length);
      const std::lock_guard lock(lookup->mutex);
      lookup->address = answer;
      lookup->size = length;
      lookup->error = error;
      lookup->done = true;
      lookup->finished.notify_all();
    }).detach();
  }
  const std::shared_ptr<Lookup> lookup = pending_;
  std::unique_lock lock(lookup->mutex);
  lookup->finished.wait_for(lock, std::chrono::duration<double>(std::max(0.0, wait_s)),
                            [&lookup] { return lookup->done; });
  if (!lookup->done) {
    problem = fmt::format(
        "no name server has answered for \"{}\" yet. Give the camera's address instead.",
        address_.host);
    return false;
  }
  pending_ = nullptr;
  if (lookup->error != 0) {
    problem = fmt::format(
        "the name \"{}\" is not known ({}). Check the name, or give the camera's address.",
        address_.host, gai_strerror(lookup->error));
    return false;
  }
  found = lookup->address;
  size = lookup->size;
  return true;
}

std::string NetworkErrorText(int error, const visca::Address& address) {
  const bool udp = address.transport == Transport::kUdp;
  switch (error) {
    case ECONNREFUSED:
      return fmt::format(
          "refuses {} port {}. Enable VISCA over IP in the camera, or set its port and transport: "
          "{}.",
          udp ? "UDP" : "TCP", address.port,
          udp ? "many cameras speak VISCA over TCP only, transport = \"tcp\""
              : "cameras with the 8-byte header use transport = \"udp\"");
    case EHOSTUNREACH:
    case ENETUNREACH:
    case EHOSTDOWN:
      return fmt::format("{}. Check the address, that the camera is on, and the network cable.",
                         ErrnoText(error));
    case EACCES:
    case EPERM:
      return fmt::format(
          "{}. The service reaches private networks only: systemctl edit plumbline.service, "
          "IPAddressAllow={}; or check the firewall of this computer.",
          ErrnoText(error), address.host);
    case ECONNRESET:
    case EPIPE:
      return "the camera has closed the connection. Check whether it was restarted or accepts only "
             "one connection.";
    default:
      return fmt::format("{}. Check the network cable.", ErrnoText(error));
  }
}

bool CameraHost::Connect(double wait_s, os::Descriptor& fd, std::string& problem) {
  sockaddr_storage to{};
  socklen_t size = 0;
  if (!Find(wait_s, to, size, problem)) return false;
  const int type = address_.transport == Transport::kUdp ? SOCK_DGRAM : SOCK_STREAM;
  fd.Reset(socket(to.ss_family, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd && (connect(fd.get(), reinterpret_cast<const sockaddr*>(&to), size) == 0 ||
             errno == EINPROGRESS)) {
    return true;
  }
  problem = NetworkErrorText(errno, address_);
  fd.Reset();
  return false;
}

}  // namespace plumbline::zoom
