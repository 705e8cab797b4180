// Cooperative cancellation by SIGINT and SIGTERM for long-running commands.
#pragma once

#include <csignal>

namespace plumbline::cli {

/// While an object of this class exists, the first SIGINT or SIGTERM is only recorded, to be polled
/// with Requested(); a second one terminates the process. At most one object may exist at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  static bool Requested();

  /// Ignores both signals from now on, until the process ends or another Interruption is created.
  /// Call it before writing results: the exit code 130 promises that no file was changed.
  /// @return false if a signal has already arrived; nothing may be written then
  bool Disarm();

 private:
  bool disarmed_ = false;
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

}  // namespace plumbline::cli
