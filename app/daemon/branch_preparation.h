// The search for the branches of taught points, beside the cycle.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#include "firmware-like/machine.h"

namespace plumbline {

/// Finds the branch of each point that names the joints where it was taught, one after another, on
/// a thread of its own at low priority: a thousand points take ten seconds, and nothing waits for
/// them. Whoever runs the machine takes over what was found so far.
///
/// The thread has a machine of its own, made of the same configuration. Results are written once
/// and read after `found_` counted them; nothing is locked, and the reader allocates nothing.
class BranchPreparation {
 public:
  /// Taken over in one call: each costs a correction in the cycle that takes it.
  static constexpr std::size_t kTakenPerCycle = 2;

  explicit BranchPreparation(const MachineConfig& config);
  ~BranchPreparation();
  BranchPreparation(const BranchPreparation&) = delete;
  BranchPreparation& operator=(const BranchPreparation&) = delete;

  void Start();
  /// Every branch was searched.
  bool finished() const { return found_.load(std::memory_order_acquire) == branches_.size(); }

  /// Hands the machine at most `most` branches that it has not been given. One thread at a time.
  void HandTo(Machine& machine, std::size_t most = kTakenPerCycle);

 private:
  void Run();

  Machine searching_;
  std::vector<std::optional<JointVector>>
      branches_;  ///< one a point; the first found_ are complete
  std::atomic<std::size_t> found_{0};
  std::size_t taken_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace plumbline
