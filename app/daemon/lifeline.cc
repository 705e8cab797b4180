#include "app/daemon/lifeline.h"

#include <utility>

namespace plumbline {

void Lifeline::Add(std::string thread, double patience_s, std::function<std::uint64_t()> beats) {
  threads_.push_back({std::move(thread), patience_s, std::move(beats)});
}

Lifeline::Standing Lifeline::Look(double now_s) {
  Standing first;
  for (Thread& thread : threads_) {
    const std::uint64_t beats = thread.beats();
    if (!thread.looked || beats != thread.seen) {
      thread.looked = true;
      thread.seen = beats;
      thread.changed_s = now_s;
    }
    const double for_s = now_s - thread.changed_s;
    if (first.thread.empty() && for_s > thread.patience_s) first = {thread.name, for_s};
  }
  return first;
}

}  // namespace plumbline
