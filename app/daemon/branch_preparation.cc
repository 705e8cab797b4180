#include "app/daemon/branch_preparation.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

namespace plumbline {
namespace {

constexpr int kNice = 10;  // of this thread alone: on Linux each has its own

}  // namespace

BranchPreparation::BranchPreparation(const MachineConfig& config)
    : searching_(config), branches_(config.points.size()) {}

BranchPreparation::~BranchPreparation() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void BranchPreparation::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "branches");
}

void BranchPreparation::Run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
  for (std::size_t k = 0; k < branches_.size() && !stop_; ++k) {
    branches_[k] = searching_.FindTaughtBranch(k);
    found_.store(k + 1, std::memory_order_release);
  }
}

void BranchPreparation::HandTo(Machine& machine, std::size_t most) {
  const std::size_t found = found_.load(std::memory_order_acquire);
  for (; taken_ < found && most > 0; ++taken_, --most) {
    machine.TakeTaughtBranch(taken_, branches_[taken_]);
  }
}

}  // namespace plumbline
