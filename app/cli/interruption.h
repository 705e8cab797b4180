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

  /// Too late from here on: the results are about to be written, and whoever is told 130 would take
  /// them for the old ones. Both signals are passed over until the end of the process, or until
  /// another Interruption. @return false where one came before: then nothing may be written
  bool TooLate();

 private:
  bool too_late_ = false;
  struct sigaction old_interrupt_ {};
  struct sigaction old_terminate_ {};
};

}  // namespace plumbline
