// The cycle and the thread that it waits for on one processor, as long as that does them good.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>

namespace plumbline {

/// Waking a thread on another processor costs both threads more than what they do, so they are kept
/// on one, the last that this process may use. A processor may belong to another real-time program,
/// or its host take it away: at the first cycle that comes late there, or where none comes at all,
/// they may go again where the scheduler wants them, for good. Used by one thread, which is not one
/// of them and may use what they may.
class OneProcessor {
 public:
  /// For how long no cycle may come [s], and how many periods.
  static constexpr double kPatience_s = 0.3, kPatiencePeriods = 3;

  struct Cycle {
    std::uint64_t cycles = 0;
    std::uint32_t overruns = 0;
    double period_s = 0;
  };
  /// @param threads  the kernel's numbers of both, 0: not begun. One that is not real-time is left
  ///                 alone, as is one that came later where they were let go.
  void Look(const Cycle& cycle, std::array<pid_t, 2> threads, double now_s);

  bool let_go() const { return let_go_; }

 private:
  void LetGo();

  std::array<pid_t, 2> kept_{};  ///< of the threads; 0: not kept
  Cycle seen_;
  double came_s_ = 0;  ///< the last cycle
  bool let_go_ = false;
};

}  // namespace plumbline
