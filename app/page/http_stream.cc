#include "app/page/http_stream.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/clock.h"

namespace plumbline {
namespace {

/// Waits at most until then. @return  whether it is ready, or broken, which the next call tells
bool WaitFor(int fd, short events, double until_s) {
  for (;;) {
    const double left_s = until_s - MonotonicSeconds();
    if (left_s <= 0) return false;
    pollfd waiting{fd, events, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(1e3 * left_s) + 1);
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
  }
}

}  // namespace

HttpStream::HttpStream(int fd, std::string peer, StreamLimits limits, double now_s)
    : fd_(fd), peer_(std::move(peer)), limits_(limits), read_until_s_(now_s + limits.request_s) {}

bool HttpStream::is_readable() const {
  return begin_ < end_ || WaitFor(fd_, POLLIN, read_until_s_);
}

bool HttpStream::is_writable() const {
  if (!WaitFor(fd_, POLLOUT, MonotonicSeconds() + limits_.write_s)) return false;
  pollfd now{fd_, POLLRDHUP, 0};
  poll(&now, 1, 0);
  return (now.revents & (POLLERR | POLLHUP | POLLRDHUP)) == 0;
}

ssize_t HttpStream::read(char* bytes, size_t size) {
  if (begin_ == end_) {
    ssize_t got = -1;
    while (got < 0) {
      if (!WaitFor(fd_, POLLIN, read_until_s_)) {
        too_slow_ = true;
        return -1;
      }
      got = recv(fd_, buffer_.data(), buffer_.size(), 0);
      if (got < 0 && errno != EAGAIN && errno != EINTR) return -1;
    }
    if (got == 0) return 0;
    begin_ = 0;
    end_ = static_cast<std::size_t>(got);
  }
  if (taken_ >= limits_.request_bytes) {
    too_long_ = true;
    return -1;
  }
  const std::size_t count = std::min({size, end_ - begin_, limits_.request_bytes - taken_});
  std::memcpy(bytes, buffer_.data() + begin_, count);
  begin_ += count;
  taken_ += count;
  return static_cast<ssize_t>(count);
}

ssize_t HttpStream::write(const char* bytes, size_t size) {
  const double begun_s = MonotonicSeconds(), end_s = begun_s + limits_.answer_s;
  double until_s = begun_s + limits_.write_s;
  wrote_ = true;
  std::size_t sent = 0;
  while (sent < size) {
    const ssize_t n = send(fd_, bytes + sent, size - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<std::size_t>(n);
      until_s = MonotonicSeconds() + limits_.write_s;
      if (sent < size && MonotonicSeconds() >= end_s) return -1;
      continue;
    }
    const bool broken = n < 0 && errno != EAGAIN && errno != EINTR;
    if (broken || !WaitFor(fd_, POLLOUT, std::min(until_s, end_s))) return -1;
  }
  return static_cast<ssize_t>(size);
}

void HttpStream::get_remote_ip_and_port(std::string& ip, int& port) const {
  ip = peer_;
  port = 0;
}

void HttpStream::get_local_ip_and_port(std::string& ip, int& port) const {
  ip.clear();
  port = 0;
}

}  // namespace plumbline
