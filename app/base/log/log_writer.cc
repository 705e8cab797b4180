#include "app/base/log/log_writer.h"

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

namespace plumbline::log {
namespace {

constexpr int kFinalTries = 20, kTryPeriod_ms = 10;

/// Opens a terminal or pipe again as non-blocking: a write to it may block even if poll() reports
/// it as writable. O_NONBLOCK on the given descriptor itself would affect every process that shares
/// it. Returns -1 if the descriptor is neither.
int ReopenNonBlocking(int descriptor) {
  struct stat file {};
  if (fstat(descriptor, &file) != 0 || (!S_ISFIFO(file.st_mode) && isatty(descriptor) == 0)) {
    return -1;
  }
  const std::string path = "/proc/self/fd/" + std::to_string(descriptor);
  return open(path.c_str(), O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

}  // namespace

LogWriter::LogWriter(std::string journal_socket, int descriptor)
    : journal_socket_(std::move(journal_socket)),
      reopened_(ReopenNonBlocking(descriptor)),
      descriptor_(reopened_ ? reopened_.get() : descriptor),
      journal_(journal_socket_.empty() ? -1 : socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}

LogWriter::~LogWriter() {
  for (int tries = 0; !buffered_.empty() && tries < kFinalTries; ++tries) {
    Flush(0);
    if (!buffered_.empty()) poll(nullptr, 0, kTryPeriod_ms);
  }
}

void LogWriter::Put(Line line, double now_s) {
  buffered_.push_back(std::move(line));
  Flush(now_s);
  if (buffered_.empty()) return;
  ++blockage_.late;
  if (buffered_.size() <= kMaxBuffered) return;
  // Drop the oldest line; a partly written one must be completed.
  buffered_.erase(buffered_.begin() + (written_bytes_ > 0 ? 1 : 0));
  --blockage_.late;
  ++blockage_.lost;
}

void LogWriter::Flush(double now_s) {
  while (!buffered_.empty()) {
    if (Write(buffered_.front()) == WriteResult::kWouldBlock) {
      if (!blocked_since_s_) blocked_since_s_ = now_s;
      return;
    }
    buffered_.pop_front();
    written_bytes_ = 0;
  }
  if (blocked_since_s_) blockage_.duration_s = now_s - *blocked_since_s_;
}

std::optional<LogWriter::Blockage> LogWriter::TakeBlockage() {
  if (!buffered_.empty() || !blocked_since_s_) return std::nullopt;
  blocked_since_s_.reset();
  return std::exchange(blockage_, {});
}

LogWriter::WriteResult LogWriter::Write(const Line& line) {
  if (journal_ && !line.datagram.empty() && written_bytes_ == 0) {
    bool refused = false;
    const WriteResult result = WriteToJournal(line.datagram, refused);
    if (!refused) return result;
  }
  return WritePlain(line.plain);
}

LogWriter::WriteResult LogWriter::WriteToJournal(const std::string& datagram, bool& refused) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  journal_socket_.copy(address.sun_path, sizeof address.sun_path - 1);
  for (;;) {
    if (sendto(journal_.get(), datagram.data(), datagram.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), sizeof address) >= 0) {
      return WriteResult::kDone;
    }
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == ENOBUFS) return WriteResult::kWouldBlock;
    refused = true;  // no journald, or the line is too long for it
    return WriteResult::kDone;
  }
}

LogWriter::WriteResult LogWriter::WritePlain(const std::string& text) {
  while (written_bytes_ < text.size()) {
    pollfd writable{descriptor_, POLLOUT, 0};
    poll(&writable, 1, 0);
    // Nobody will ever read this: discard the line instead of buffering.
    if ((writable.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return WriteResult::kDone;
    if ((writable.revents & POLLOUT) == 0) return WriteResult::kWouldBlock;
    // A writable pipe accepts PIPE_BUF bytes without blocking [pipe(7)].
    const std::size_t piece = std::min<std::size_t>(text.size() - written_bytes_, PIPE_BUF);
    ssize_t written =
        send(descriptor_, text.data() + written_bytes_, piece, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) {
      written = write(descriptor_, text.data() + written_bytes_, piece);
    }
    if (written > 0) {
      written_bytes_ += static_cast<std::size_t>(written);
    } else if (errno == EAGAIN) {
      return WriteResult::kWouldBlock;
    } else if (errno != EINTR) {
      return WriteResult::kDone;  // unwritable: discard the line
    }
  }
  return WriteResult::kDone;
}

}  // namespace plumbline::log
