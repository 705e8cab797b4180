// Owning file descriptor.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace plumbline::os {

/// Owns one descriptor of the process, or none (-1). Closing does not change errno, so that the
/// reason of a failed call can still be reported after an early return.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}  ///< takes ownership; negative for none
  Descriptor(Descriptor&& other) noexcept : fd_(other.Release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Reset(other.Release());
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { Reset(); }

  explicit operator bool() const { return fd_ >= 0; }
  int get() const { return fd_; }  ///< -1: none

  /// Closes the descriptor and owns `fd` instead.
  void Reset(int fd = -1) {
    const int old = std::exchange(fd_, fd < 0 ? -1 : fd);
    if (old < 0) return;
    const int error = errno;
    close(old);
    errno = error;
  }

  /// Closes a file after writing, and checks for errors: a network share may report a lost write
  /// only at this point.
  /// @return false with errno set
  bool CloseWritten() { return close(Release()) == 0; }

  /// Gives ownership to the caller. @return  -1 if there was none
  [[nodiscard]] int Release() { return std::exchange(fd_, -1); }

 private:
  int fd_ = -1;
};

}  // namespace plumbline::os
