// Virtual controllers running on a thread of their own, for tests with real sockets.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "tests/virtual_ur/rtde_server.h"
#include "tests/virtual_ur/virtual_ur.h"

namespace virtual_ur {

/// An RTDE server alone, with an arm that stands still unless the test moves it.
class BareUr : public RtdeServer {
 public:
  void Step() {
    next_s_ += kCycle_s;
    Serve(next_s_);
    Advance();
  }
  std::string Execute(const std::string& words) { return SetFault(words); }

 private:
  double next_s_ = MonotonicNow();
};

/// @tparam Ur  BareUr or VirtualUr
template <typename Ur>
class Running {
 public:
  template <typename... Arguments>
  explicit Running(Arguments&&... arguments)
      : ur_(std::forward<Arguments>(arguments)...), thread_([this] { Run(); }) {}
  ~Running() {
    stop_ = true;
    thread_.join();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  /// Calls `work` between two cycles of the controller, and waits for its result.
  template <typename Work>
  auto With(const Work& work) {
    using Answer = std::invoke_result_t<Work, Ur&>;
    auto task = std::make_shared<std::packaged_task<Answer()>>([&] { return work(ur_); });
    std::future<Answer> answer = task->get_future();
    {
      const std::lock_guard lock(mutex_);
      tasks_.emplace_back([task] { (*task)(); });
    }
    return answer.get();
  }
  std::string Execute(const std::string& line) {
    return With([&](Ur& ur) { return ur.Execute(line); });
  }

 private:
  void Run() {
    while (!stop_) {
      ur_.Step();
      std::vector<std::function<void()>> due;
      {
        const std::lock_guard lock(mutex_);
        due.swap(tasks_);
      }
      for (const auto& task : due) task();
    }
  }

  Ur ur_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::vector<std::function<void()>> tasks_;
  std::thread thread_;
};

class RunningUr : public Running<BareUr> {
 public:
  int port() {
    return With([](BareUr& ur) { return ur.port(); });
  }
  std::string Fault(const std::string& words) { return Execute(words); }
  UrState State() {
    return With([](BareUr& ur) { return ur.state(); });
  }
};

}  // namespace virtual_ur
