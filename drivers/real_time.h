// Threads that the machine's cycle waits for.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <thread>

namespace plumbline {

/// The cycle goes before the thread that asks the robot for it: its tick must not wait for a
/// reading that is late. Everything else of the computer comes after both.
inline constexpr int kCyclePriority = 10, kRobotPriority = 9;

/// First in, first out at `priority`, where the service manager allows it (LimitRTPRIO); elsewhere
/// the thread works on as it was. All of them on one processor, the last that is allowed: they wait
/// for each other, and waking a thread on another processor costs both of them more than their
/// work.
/// @param name  at most 15 characters, for `ps -L` and `chrt -ap`
inline void MakeRealTime(std::thread& thread, int priority, const char* name) {
  const pthread_t handle = thread.native_handle();
  pthread_setname_np(handle, name);
  sched_param wanted{};
  wanted.sched_priority = priority;
  if (pthread_setschedparam(handle, SCHED_FIFO, &wanted) != 0) return;
  cpu_set_t allowed, one;
  if (pthread_getaffinity_np(handle, sizeof allowed, &allowed) != 0) return;
  for (std::size_t cpu = CPU_SETSIZE; cpu-- > 0;) {
    if (!CPU_ISSET(cpu, &allowed)) continue;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    pthread_setaffinity_np(handle, sizeof one, &one);
    return;
  }
}

}  // namespace plumbline
