#include "app/cell/daemon/cycle_affinity.h"

#include <sched.h>

#include <algorithm>

#include "drivers/real_time.h"

namespace plumbline::cell {

void CycleAffinity::Update(const CycleCount& count, std::array<pid_t, 2> threads, double now_s) {
  if (released_) return;
  const bool any_pinned = pinned_ != std::array<pid_t, 2>{};
  const bool late = any_pinned && count.overruns != last_.overruns;
  if (count.cycles != last_.cycles || !any_pinned) last_cycle_s_ = now_s;
  const double timeout_s = std::max(kTimeout_s, kTimeoutPeriods * count.period_s);
  last_ = count;
  if (late || now_s - last_cycle_s_ > timeout_s) return Release();
  const int processor = LastAllowedCpu();
  for (std::size_t k = 0; k < threads.size(); ++k) {
    const bool real_time = threads[k] > 0 && sched_getscheduler(threads[k]) == SCHED_FIFO;
    if (pinned_[k] == threads[k] || !real_time) continue;
    if (PinThread(threads[k], processor)) pinned_[k] = threads[k];
  }
}

void CycleAffinity::Release() {
  released_ = true;
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  for (const pid_t thread : pinned_) {
    if (thread > 0) sched_setaffinity(thread, sizeof allowed, &allowed);
  }
}

}  // namespace plumbline::cell
