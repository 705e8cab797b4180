// Threads that the machine's cycle waits for.
#pragma once

#include <pthread.h>

#include <thread>

namespace plumbline {

/// The cycle goes before the thread that asks the robot for it: its tick must not wait for a
/// reading that is late. Everything else of the computer comes after both.
inline constexpr int kCyclePriority = 10, kRobotPriority = 9;

/// First in, first out at `priority`, where the service manager allows it (LimitRTPRIO); elsewhere
/// the thread works on as it was. @param name  at most 15 characters, for `ps -L` and `chrt -ap`
inline void MakeRealTime(std::thread& thread, int priority, const char* name) {
  sched_param wanted{};
  wanted.sched_priority = priority;
  pthread_setschedparam(thread.native_handle(), SCHED_FIFO, &wanted);
  pthread_setname_np(thread.native_handle(), name);
}

}  // namespace plumbline
