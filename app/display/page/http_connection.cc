#include "app/display/page/http_connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

#include "app/display/page/http_message.h"
#include "drivers/clock.h"

namespace plumbline::display {
namespace {

/// @return  true if the descriptor is ready or broken, which the next call on it reports
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

HttpConnection::HttpConnection(int fd, ConnectionLimits limits, double now_s)
    : fd_(fd), limits_(limits), read_until_s_(now_s + limits.request_s) {}

HttpConnection::Head HttpConnection::ReadHead(std::string& head) {
  char bytes[2048];
  while (head.size() < limits_.request_bytes) {
    if (!WaitFor(fd_, POLLIN, read_until_s_)) return Head::kTooSlow;
    const std::size_t room = std::min(sizeof bytes, limits_.request_bytes - head.size());
    const ssize_t got = recv(fd_, bytes, room, 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (got <= 0) return Head::kLost;
    const std::size_t seen = head.size();
    head.append(bytes, static_cast<std::size_t>(got));
    if (const auto end = EndOfHead(head, seen)) {
      head.resize(*end);
      return Head::kComplete;
    }
  }
  return Head::kTooLong;
}

bool HttpConnection::IsWritable() const {
  if (!WaitFor(fd_, POLLOUT, MonotonicSeconds() + limits_.write_s)) return false;
  pollfd now{fd_, POLLRDHUP, 0};
  poll(&now, 1, 0);
  return (now.revents & (POLLERR | POLLHUP | POLLRDHUP)) == 0;
}

bool HttpConnection::Write(std::string_view bytes) {
  const double begun_s = MonotonicSeconds(), end_s = begun_s + limits_.answer_s;
  double until_s = begun_s + limits_.write_s;
  while (!bytes.empty()) {
    const ssize_t n = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (n > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(n));
      until_s = MonotonicSeconds() + limits_.write_s;
      if (!bytes.empty() && MonotonicSeconds() >= end_s) return false;
      continue;
    }
    const bool broken = n < 0 && errno != EAGAIN && errno != EINTR;
    if (broken || !WaitFor(fd_, POLLOUT, std::min(until_s, end_s))) return false;
  }
  return true;
}

}  // namespace plumbline::display
