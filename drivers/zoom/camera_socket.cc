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

}  // namespace

/// Shared with the thread, which may outlive the sensor.
struct CameraHost::Lookup {
  std::mutex mutex;  ///< guards the rest
  std::condition_variable finished;
  bool done = false;
  os::HostAddresses answer;
};

bool CameraHost::Find(double wait_s, std::string& problem) {
  found_ = os::FindHost(address_.host, address_.port, os::HostForm::kNumeric).list;
  if (!found_.empty()) return true;
  if (!pending_) {
    pending_ = std::make_shared<Lookup>();
    std::thread([lookup = pending_, address = address_] {
      os::HostAddresses answer = os::FindHost(address.host, address.port, os::HostForm::kAny);
      const std::lock_guard lock(lookup->mutex);
      lookup->answer = std::move(answer);
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
  found_ = lookup->answer.list;
  if (found_.empty()) {
    problem = fmt::format(
        "the name \"{}\" is not known ({}). Check the name, or give the camera's address.",
        address_.host, gai_strerror(lookup->answer.error));
    return false;
  }
  return true;
}

std::string CameraHost::ErrorText(int error) const {
  const bool udp = address_.transport == Transport::kUdp;
  switch (error) {
    case ECONNREFUSED:
      return fmt::format(
          "refuses {} port {}. Enable VISCA over IP in the camera, or set its port and transport: "
          "{}.",
          udp ? "UDP" : "TCP", address_.port,
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
          ErrnoText(error), next_ < found_.size() ? found_[next_].Text() : "ADDRESS");
    case ECONNRESET:
    case EPIPE:
      return "the camera has closed the connection. Check whether it was restarted or accepts only "
             "one connection.";
    default:
      return fmt::format("{}. Check the network cable.", ErrnoText(error));
  }
}

bool CameraHost::Connect(double wait_s, os::Descriptor& fd, std::string& problem) {
  if (next_ == 0 && !Find(wait_s, problem)) return false;
  const int type = address_.transport == Transport::kUdp ? SOCK_DGRAM : SOCK_STREAM;
  do {
    const os::HostAddress& to = found_[next_];
    fd.Reset(socket(to.storage.ss_family, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (fd && (connect(fd.get(), to.get(), to.size) == 0 || errno == EINPROGRESS)) return true;
    problem = ErrorText(errno);
    fd.Reset();
  } while (TryNext());
  return false;
}

bool CameraHost::TryNext() {
  next_ = next_ + 1 < found_.size() ? next_ + 1 : 0;
  return next_ > 0;
}

}  // namespace plumbline::zoom
