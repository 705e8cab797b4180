#include "app/cli/interruption.h"

namespace plumbline::cli {
namespace {

volatile std::sig_atomic_t requested = 0;

void HandleSignal(int) {
  requested = 1;
}

}  // namespace

Interruption::Interruption() {
  requested = 0;
  struct sigaction action {};
  action.sa_handler = &HandleSignal;
  // The second signal has the default effect, in case the work does not poll often enough.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

bool Interruption::Disarm() {
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigemptyset(&ignore.sa_mask);
  sigaction(SIGINT, &ignore, nullptr);
  sigaction(SIGTERM, &ignore, nullptr);
  disarmed_ = !Requested();
  return disarmed_;
}

Interruption::~Interruption() {
  if (disarmed_) return;
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool Interruption::Requested() {
  return requested != 0;
}

}  // namespace plumbline::cli
