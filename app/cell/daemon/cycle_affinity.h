// CPU pinning of the control cycle and the robot thread, until the first overrun.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>

namespace plumbline::cell {

/// Pins the control cycle and the robot thread that it waits for to one CPU, the last that this
/// process may use: waking a thread on another CPU costs more than what either thread does. That
/// CPU may be occupied by another real-time program, or withheld by a hypervisor; so at the first
/// late cycle, or if cycles stop, both threads are released for good and the scheduler may migrate
/// them. Used by one thread, which is neither of the two and has the affinity that they should get
/// back.
class CycleAffinity {
 public:
  /// Both threads are released if no cycle ran for the longer of kTimeout_s and kTimeoutPeriods
  /// periods.
  static constexpr double kTimeout_s = 0.3, kTimeoutPeriods = 3;

  struct CycleCount {
    std::uint64_t cycles = 0;
    std::uint32_t overruns = 0;
    double period_s = 0;
  };
  /// To be called periodically.
  /// @param threads  kernel thread ids of both, 0 if not started yet. Threads without real-time
  ///                 priority are never pinned, nor is any thread after the release
  void Update(const CycleCount& count, std::array<pid_t, 2> threads, double now_s);

  bool released() const { return released_; }

 private:
  void Release();

  std::array<pid_t, 2> pinned_{};  ///< thread ids; 0: not pinned
  CycleCount last_;
  double last_cycle_s_ = 0;
  bool released_ = false;
};

}  // namespace plumbline::cell
