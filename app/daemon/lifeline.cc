#include "app/daemon/lifeline.h"

#include <utility>

namespace plumbline {

namespace {

/// Of its patience, after which a thread is late.
constexpr double kLate = 0.5;

}  // namespace

void Lifeline::Add(std::string thread, double patience_s, std::function<std::uint64_t()> beats,
                   std::function<bool()> waits) {
  threads_.push_back({std::move(thread), patience_s, std::move(beats), std::move(waits)});
}

void Lifeline::SetPatience(const std::string& name, double patience_s) {
  for (Thread& thread : threads_) {
    if (thread.name == name) thread.patience_s = patience_s;
  }
}

Lifeline::Standing Lifeline::Look(double now_s) {
  Standing first;
  for (Thread& thread : threads_) {
    const std::uint64_t beats = thread.beats();
    if (!thread.looked || beats != thread.seen) {
      thread.looked = true;
      thread.seen = beats;
      thread.changed_s = thread.excused_s = now_s;
    }
    const double for_s = now_s - thread.changed_s;
    if (for_s > kLate * thread.patience_s && for_s <= kDevicePatience_s && thread.waits()) {
      thread.excused_s = now_s;
    }
    if (first.thread.empty() && now_s - thread.excused_s > thread.patience_s) {
      first = {thread.name, for_s};
    }
  }
  return first;
}

}  // namespace plumbline
