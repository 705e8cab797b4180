#include "app/cell/daemon/taught_branch_search.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

namespace plumbline::cell {
namespace {

constexpr int kNice = 10;  // on Linux the nice value is per thread

}  // namespace

TaughtBranchSearch::TaughtBranchSearch(const MachineConfig& config)
    : searching_(config), branches_(config.points.size()) {}

TaughtBranchSearch::~TaughtBranchSearch() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void TaughtBranchSearch::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "branches");
}

void TaughtBranchSearch::Run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
  for (std::size_t k = 0; k < branches_.size() && !stop_; ++k) {
    branches_[k] = searching_.FindTaughtBranch(k);
    found_.store(k + 1, std::memory_order_release);
  }
}

void TaughtBranchSearch::DeliverTo(Machine& machine, std::size_t max_count) {
  const std::size_t found = found_.load(std::memory_order_acquire);
  for (; delivered_ < found && max_count > 0; ++delivered_, --max_count) {
    machine.SetTaughtBranch(delivered_, branches_[delivered_]);
  }
}

}  // namespace plumbline::cell
