#include "app/log/log_outlet.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <utility>

namespace plumbline {
namespace {

constexpr int kTriesAtEnd = 20, kBetweenTries_ms = 10;

/// Writing to a terminal or a pipe may wait although it is ready for some bytes. Opened once more
/// it does not, and whoever shares the descriptor notices nothing. -1: it is neither.
int OpenedNotToWait(int descriptor) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0 || (!S_ISFIFO(file.st_mode) && isatty(descriptor) == 0)) {
    return -1;
  }
  const std::string path = "/proc/self/fd/" + std::to_string(descriptor);
  return open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

LogOutlet::LogOutlet(std::string journal_socket, int descriptor)
    : journal_socket_(std::move(journal_socket)),
      own_(OpenedNotToWait(descriptor)),
      descriptor_(own_ ? own_.get() : descriptor),
      journal_(journal_socket_.empty() ? -1 : socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

LogOutlet::~LogOutlet() {
  for (int tries = 0; !waiting_.empty() && tries < kTriesAtEnd; ++tries) {
    Flush(0);
    if (!waiting_.empty()) poll(nullptr, 0, kBetweenTries_ms);
  }
}

void LogOutlet::Put(Line line, double now_s) {
  waiting_.push_back(std::move(line));
  Flush(now_s);
  if (waiting_.empty()) return;
  ++held_up_.late;
  if (waiting_.size() <= kMostWaiting) return;
  // A line that is partly out is not broken off.
  waiting_.erase(waiting_.begin() + (begun_ > 0 ? 1 : 0));
  --held_up_.late;
  ++held_up_.lost;
}

void LogOutlet::Flush(double now_s) {
  while (!waiting_.empty()) {
    if (Give(waiting_.front()) == Went::kNotNow) {
      if (!held_since_s_) held_since_s_ = now_s;
      return;
    }
    waiting_.pop_front();
    begun_ = 0;
  }
  if (held_since_s_) held_up_.for_s = now_s - *held_since_s_;
}

std::optional<LogOutlet::HeldUp> LogOutlet::TakeHeldUp() {
  if (!waiting_.empty() || !held_since_s_) return std::nullopt;
  held_since_s_.reset();
  return std::exchange(held_up_, {});
}

LogOutlet::Went LogOutlet::Give(const Line& line) {
  if (journal_ && !line.datagram.empty() && begun_ == 0) {
    bool refused = false;
    const Went went = GiveToJournal(line.datagram, refused);
    if (!refused) return went;
  }
  return GivePlain(line.plain);
}

LogOutlet::Went LogOutlet::GiveToJournal(const std::string& datagram, bool& refused) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  journal_socket_.copy(address.sun_path, sizeof address.sun_path - 1);
  for (;;) {
    if (sendto(journal_.get(), datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), sizeof address) >= 0) {
      return Went::kYes;
    }
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == ENOBUFS) return Went::kNotNow;
    refused = true;  // there is no journald, or the line is too long for it
    return Went::kYes;
  }
}

LogOutlet::Went LogOutlet::GivePlain(const std::string& text) {
  while (begun_ < text.size()) {
    pollfd writable{descriptor_, POLLOUT, 0};
    poll(&writable, 1, 0);
    // Where nobody will ever read, nothing waits.
    if ((writable.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return Went::kYes;
    if ((writable.revents & POLLOUT) == 0) return Went::kNotNow;
    // So much a writable pipe takes at once (pipe(7)).
    const std::size_t piece = std::min<std::size_t>(text.size() - begun_, PIPE_BUF);
    ssize_t written = send(descriptor_, text.data() + begun_, piece, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) {
      written = write(descriptor_, text.data() + begun_, piece);
    }
    if (written > 0) {
      begun_ += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN) {
      return Went::kNotNow;
    } else if (errno != EINTR) {
      return Went::kYes;  // nothing can be done
    }
  }
  return Went::kYes;
}

}  // namespace plumbline
