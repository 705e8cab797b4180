// Ctrl-C and a service manager's stop, as a question that long work asks.
#pragma once

#include <csignal>

namespace plumbline {

/// While one lives, SIGINT and SIGTERM are noted in place of ending the process. A second one ends
/// it. One at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  static bool Asked();

 private:
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

}  // namespace plumbline
