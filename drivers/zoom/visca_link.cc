#include "drivers/zoom/visca_link.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "drivers/files/open_failure.h"
#include "drivers/os/serial_line.h"
#include "drivers/zoom/camera_socket.h"
#include "drivers/zoom/visca_over_ip.h"

namespace plumbline::zoom {
namespace {

using visca::Transport;

/// Waits for at most `left_s` until the descriptor is ready. @return the result of poll()
int WaitFor(int fd, short events, double left_s) {
  pollfd wait{.fd = fd, .events = events, .revents = 0};
  const int ready = poll(&wait, 1, std::max(0, static_cast<int>(std::ceil(1e3 * left_s))));
  if (ready <= 0 || (wait.revents & events) != 0) return ready;
  errno = EIO;  // hung up with nothing to read
  return -1;
}

/// Packets in a stream of bytes.
class StreamLink : public ViscaLink {
 public:
  StreamLink(visca::Address address, Clock clock) : address_(std::move(address)), clock_(clock) {}

  bool is_open() const override { return static_cast<bool>(fd_); }
  void Close() override {
    fd_.Reset();
    receiver_.Clear();
  }

  bool Send(const visca::Request& request, double deadline_s) override {
    receiver_.Clear();
    std::span<const std::uint8_t> rest = request.span();
    while (!rest.empty()) {
      const ssize_t written = Write(rest);
      if (written > 0) {
        rest = rest.subspan(static_cast<std::size_t>(written));
        continue;
      }
      const bool again = written < 0 && (errno == EAGAIN || errno == EINTR);
      const int ready = again ? WaitFor(fd_.get(), POLLOUT, deadline_s - clock_()) : -1;
      if (ready > 0) continue;
      problem_ = LossText(ready == 0 ? ETIMEDOUT : errno);
      return false;
    }
    return true;
  }

  /// One byte at a time: what follows the packet is left for the next call.
  Arrival Receive(double deadline_s, visca::Reply& reply) override {
    for (;;) {
      std::uint8_t byte = 0;
      const ssize_t size = read(fd_.get(), &byte, 1);
      if (size == 1) {
        const std::optional<visca::Reply> found = receiver_.Push(byte);
        if (clock_() > deadline_s + kFlood_s) return Arrival::kNone;
        if (!found) continue;
        reply = *found;
        return Arrival::kPacket;
      }
      if (size == 0) return Lost(0);
      if (errno == EINTR) continue;
      if (errno != EAGAIN) return Lost(errno);
      const double left_s = deadline_s - clock_();
      const int ready = left_s > 0 ? WaitFor(fd_.get(), POLLIN, left_s) : 0;
      if (ready < 0 && errno != EINTR) return Lost(0);
      if (ready == 0) return Arrival::kNone;
    }
  }

 protected:
  virtual ssize_t Write(std::span<const std::uint8_t> bytes) = 0;
  /// Reason and remedy. @param error  errno; 0 if the other end has hung up
  virtual std::string LossText(int error) const = 0;
  int fd() const { return fd_.get(); }

  const visca::Address address_;
  const Clock clock_;
  os::Descriptor fd_;

 private:
  Arrival Lost(int error) {
    problem_ = LossText(error);
    return Arrival::kLost;
  }

  visca::Receiver receiver_;
};

class SerialLink : public StreamLink {
 public:
  SerialLink(const visca::Address& address, int baud, Clock clock)
      : StreamLink(address, clock), baud_(baud) {}

  bool Open(double) override {
    Close();
    fd_.Reset(open(address_.host.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (fd_ && os::ConfigureSerialLine(fd(), {.baud = baud_})) return true;
    problem_ = files::OpenErrorText(errno, files::kSerialLine);
    return false;
  }
  std::string SilenceText(double timeout_s) const override {
    return fmt::format("no answer within {:.0f} ms. Check that it is on and set to {} baud.",
                       1e3 * timeout_s, baud_);
  }
  std::string GarbageText(int packets) const override {
    return fmt::format("{} invalid packets. Check that the camera is set to {} baud.", packets,
                       baud_);
  }

 protected:
  ssize_t Write(std::span<const std::uint8_t> bytes) override {
    return write(fd(), bytes.data(), bytes.size());
  }
  std::string LossText(int error) const override {
    return fmt::format("the line is lost: {}. Check the cable and the adapter.",
                       error == 0 ? "hung up" : std::strerror(error));
  }

 private:
  const int baud_;
};

class TcpLink : public StreamLink {
 public:
  TcpLink(const visca::Address& address, Clock clock)
      : StreamLink(address, clock), host_(address) {}

  bool Open(double deadline_s) override {
    do {
      Close();
      if (!host_.Connect(deadline_s - clock_(), fd_, problem_)) return false;
      if (AwaitConnection(deadline_s)) return true;
    } while (host_.TryNext() && clock_() < deadline_s);
    Close();
    return false;
  }
  /// A late answer is lost with its connection.
  void OnTimeout() override { Close(); }
  std::string SilenceText(double timeout_s) const override {
    return fmt::format(
        "connected, but no answer within {:.0f} ms. Check that it is on and that this is its port "
        "for VISCA, and increase timeout_ms.",
        1e3 * timeout_s);
  }
  std::string GarbageText(int packets) const override {
    return fmt::format("{} invalid packets. Check that port {} is the camera's port for VISCA.",
                       packets, address_.port);
  }

 protected:
  ssize_t Write(std::span<const std::uint8_t> bytes) override {
    return send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  std::string LossText(int error) const override {
    return host_.ErrorText(error == 0 ? ECONNRESET : error);
  }

 private:
  bool AwaitConnection(double deadline_s) {
    int ready = 0;
    do {
      ready = WaitFor(fd(), POLLOUT, deadline_s - clock_());
    } while (ready < 0 && errno == EINTR);
    const int poll_error = ready < 0 ? errno : 0;
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(fd(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error == 0) error = poll_error;
    if (ready == 0) {
      problem_ =
          "no connection in time. Check the address, that the camera is on, and the network cable.";
    } else if (error != 0) {
      problem_ = host_.ErrorText(error);
    } else {
      const int on = 1;
      setsockopt(fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      return true;
    }
    return false;
  }

  CameraHost host_;
};

}  // namespace

std::unique_ptr<ViscaLink> MakeViscaLink(const visca::Address& address, int baud, Clock clock) {
  switch (address.transport) {
    case Transport::kUdp:
      return std::make_unique<ViscaOverIp>(address, clock);
    case Transport::kTcp:
      return std::make_unique<TcpLink>(address, clock);
    case Transport::kSerial:
      break;
  }
  return std::make_unique<SerialLink>(address, baud, clock);
}

}  // namespace plumbline::zoom
