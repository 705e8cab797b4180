// Real-time priority and CPU affinity of the control cycle and the robot thread.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/types.h>

namespace plumbline {

/// SCHED_FIFO priorities. The control cycle preempts the robot thread: a tick must not wait for a
/// late reading. The motion link preempts both: it takes less than 0.1 ms of each 4 ms, and a
/// controller stops if its answers are late. All preempt everything that is not real-time.
inline constexpr int kCyclePriority = 10, kRobotPriority = 9, kMotionPriority = 11;

/// Schedules the calling thread as SCHED_FIFO at `priority` and names it. Without permission
/// (LimitRTPRIO of the service) the thread keeps its normal scheduling.
/// @param name  at most 15 characters, for `ps -L` and `chrt -ap`
inline void SetRealTimePriority(int priority, const char* name) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  pthread_setname_np(pthread_self(), name);
}

/// The last CPU that the calling thread may use; -1 if not known.
inline int LastAllowedCpu() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return -1;
  int last = CPU_SETSIZE - 1;
  while (last >= 0 && !CPU_ISSET(static_cast<unsigned>(last), &allowed)) --last;
  return last;
}

/// Sanitizers use spin locks: a real-time thread that spins on a lock whose owner is pinned to the
/// same CPU never gets it.
#ifdef PLUMBLINE_SANITIZED
inline constexpr bool kLocksSpin = true;
#else
inline constexpr bool kLocksSpin = false;
#endif

/// Pins a thread of this process to `processor`. @return  whether that was permitted
inline bool PinThread(pid_t thread, int processor) {
  if (processor < 0 || kLocksSpin) return false;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(processor), &one);
  return sched_setaffinity(thread, sizeof one, &one) == 0;
}

}  // namespace plumbline
