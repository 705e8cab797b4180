// A virtual cell running on its own thread, for tests with real sockets.
#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/virtual_cell/register_client.h"
#include "tests/virtual_cell/virtual_cell.h"

namespace virtual_cell {

inline CellDescription DemoCell() {
  return ReadCellFile("tests/virtual_cell/demo/cockpit-cell.toml");
}
inline MotionProgram DemoProgram() {
  return ReadProgramFile("tests/virtual_cell/demo/cockpit-program.toml");
}

class RunningCell {
 public:
  explicit RunningCell(const VirtualCellOptions& options, Effects effects = {})
      : RunningCell(World(DemoCell(), std::move(effects)), DemoProgram(), options) {}
  RunningCell(World world, MotionProgram program, const VirtualCellOptions& options)
      : cell_(std::move(world), std::move(program), options), thread_([this] { Run(); }) {}
  ~RunningCell() {
    stop_ = true;
    thread_.join();
  }

  std::string robot() const { return "127.0.0.1:" + std::to_string(cell_.robot_port()); }
  std::string tracker() const { return "127.0.0.1:" + std::to_string(cell_.tracker_port()); }

  /// Executes a console line between two steps and waits for its answer.
  std::string Tell(const std::string& line) {
    std::promise<std::string> answer;
    std::future<std::string> response = answer.get_future();
    {
      const std::lock_guard lock(mutex_);
      lines_.emplace_back(line, std::move(answer));
    }
    return response.get();
  }

 private:
  void Run() {
    while (!stop_) {
      const auto now = std::chrono::steady_clock::now().time_since_epoch();
      cell_.Step(std::chrono::duration<double>(now).count(), 0.001);
      const std::lock_guard lock(mutex_);
      for (auto& [line, answer] : lines_) answer.set_value(cell_.Execute(line));
      lines_.clear();
    }
  }

  VirtualCell cell_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::vector<std::pair<std::string, std::promise<std::string>>> lines_;
  std::thread thread_;
};

/// How long a test waits for what must come. A busy machine may take many times as long as an idle
/// one, and instrumented code ten times as long again; a test that passes never waits for the end.
inline constexpr std::chrono::seconds kPatience{60};

/// Polls until `holds()`; false after `kPatience`.
template <typename Condition>
bool Eventually(Condition holds) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < give_up) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

}  // namespace virtual_cell
