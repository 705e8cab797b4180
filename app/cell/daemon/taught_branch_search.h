// Background search for the inverse-kinematics branches of taught points.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "firmware-like/machine.h"

namespace plumbline::cell {

/// Finds, for each point that was taught with joint values, the branch it belongs to. The points
/// are searched one after another on a separate low-priority thread, because a thousand points take
/// ten seconds. The control cycle takes results as they become available.
///
/// The thread works on its own Machine with the same configuration. Each result is written once,
/// before `found_` counts it, and only read afterwards: no locks, and the reader allocates nothing.
class TaughtBranchSearch {
 public:
  /// Branches delivered in one cycle: each requires a correction to be computed in that cycle.
  static constexpr std::size_t kMaxPerCycle = 2;

  explicit TaughtBranchSearch(const MachineConfig& config);
  ~TaughtBranchSearch();
  TaughtBranchSearch(const TaughtBranchSearch&) = delete;
  TaughtBranchSearch& operator=(const TaughtBranchSearch&) = delete;

  void Start();
  bool finished() const { return found_.load(std::memory_order_acquire) == branches_.size(); }

  /// Passes at most `max_count` new branches to the machine. One thread at a time.
  void DeliverTo(Machine& machine, std::size_t max_count = kMaxPerCycle);

 private:
  void Run();

  Machine searching_;
  std::vector<std::optional<model::JointVector>>
      branches_;  ///< one per point; the first found_ are final
  std::atomic<std::size_t> found_{0};
  std::size_t delivered_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plumbline::cell
