// Threads that the machine's cycle waits for.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/types.h>

namespace plumbline {

/// The cycle goes before the thread that asks the robot for it: its tick must not wait for a
/// reading that is late. Everything else of the computer comes after both.
inline constexpr int kCyclePriority = 10, kRobotPriority = 9;

/// The calling thread goes first in, first out at `priority`, where the service manager allows it
/// (LimitRTPRIO); elsewhere it works on as it was.
/// @param name  at most 15 characters, for `ps -L` and `chrt -ap`
inline void MakeRealTime(int priority, const char* name) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  pthread_setname_np(pthread_self(), name);
}

/// The last processor that the calling thread may use; -1: not known.
inline int LastProcessor() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return -1;
  int last = CPU_SETSIZE - 1;
  while (last >= 0 && !CPU_ISSET(static_cast<unsigned>(last), &allowed)) --last;
  return last;
}

/// The sanitizers' own locks spin: a real-time thread that waits for another one's on the same
/// processor waits for ever.
#ifdef PLUMBLINE_SANITIZED
inline constexpr bool kLocksSpin = true;
#else
inline constexpr bool kLocksSpin = false;
#endif

/// A thread of this process runs on `processor` alone from now on. False where it may not.
inline bool KeepOn(pid_t thread, int processor) {
  if (processor < 0 || kLocksSpin) return false;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(static_cast<unsigned>(processor), &one);
  return sched_setaffinity(thread, sizeof one, &one) == 0;
}

}  // namespace plumbline
