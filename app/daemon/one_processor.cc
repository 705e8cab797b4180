#include "app/daemon/one_processor.h"

#include <sched.h>

#include <algorithm>

#include "drivers/real_time.h"

namespace plumbline {

void OneProcessor::Look(const Cycle& cycle, std::array<pid_t, 2> threads, double now_s) {
  if (let_go_) return;
  const bool keeps = kept_ != std::array<pid_t, 2>{};
  const bool late = keeps && cycle.overruns != seen_.overruns;
  if (cycle.cycles != seen_.cycles || !keeps) came_s_ = now_s;
  const double patience_s = std::max(kPatience_s, kPatiencePeriods * cycle.period_s);
  seen_ = cycle;
  if (late || now_s - came_s_ > patience_s) return LetGo();
  const int processor = LastProcessor();
  for (std::size_t k = 0; k < threads.size(); ++k) {
    const bool real_time = threads[k] > 0 && sched_getscheduler(threads[k]) == SCHED_FIFO;
    if (kept_[k] == threads[k] || !real_time) continue;
    if (KeepOn(threads[k], processor)) kept_[k] = threads[k];
  }
}

void OneProcessor::LetGo() {
  let_go_ = true;
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  for (const pid_t thread : kept_) {
    if (thread > 0) sched_setaffinity(thread, sizeof allowed, &allowed);
  }
}

}  // namespace plumbline
