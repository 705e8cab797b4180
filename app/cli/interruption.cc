#include "app/cli/interruption.h"

namespace plumbline {
namespace {

volatile std::sig_atomic_t asked = 0;

void Note(int) {
  asked = 1;
}

}  // namespace

Interruption::Interruption() {
  asked = 0;
  struct sigaction action {};
  action.sa_handler = &Note;
  // The second signal finds the default again, should the work not ask often enough.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

bool Interruption::TooLate() {
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigemptyset(&ignore.sa_mask);
  sigaction(SIGINT, &ignore, nullptr);
  sigaction(SIGTERM, &ignore, nullptr);
  too_late_ = !Asked();
  return too_late_;
}

Interruption::~Interruption() {
  if (too_late_) return;
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool Interruption::Asked() {
  return asked != 0;
}

}  // namespace plumbline
