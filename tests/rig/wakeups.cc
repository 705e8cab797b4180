// What the wake-ups of the daemon's cycle take on this computer with nothing in them: a thread that
// wakes a hundred times a second, asks another one and waits for its answer, as cycle and robot do.
#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <thread>

#include "drivers/real_time.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)
using Clock = std::chrono::steady_clock;

constexpr auto kPeriod = std::chrono::milliseconds(10);

std::mutex mutex;
std::condition_variable asked, answered;
int questions = 0, answers = 0;
bool stop = false;

void Answer() {
  for (;;) {
    {
      std::unique_lock lock(mutex);
      asked.wait(lock, [] { return stop || questions != answers; });
      if (stop) return;
      answers = questions;
    }
    answered.notify_one();
  }
}

void Ask(int cycles) {
  Clock::time_point tick = Clock::now();
  for (int k = 0; k < cycles; ++k, tick += kPeriod) {
    {
      const std::lock_guard lock(mutex);
      ++questions;
    }
    asked.notify_one();
    {
      std::unique_lock lock(mutex);
      answered.wait_until(lock, tick + kPeriod / 2, [] { return answers == questions; });
    }
    std::this_thread::sleep_until(tick + kPeriod);
  }
  const std::lock_guard lock(mutex);
  stop = true;
  asked.notify_one();
}

}  // namespace

int main(int argc, char** argv) {
  const int seconds = argc == 2 ? static_cast<int>(std::strtol(argv[1], nullptr, 10)) : 0;
  if (seconds < 1) {
    fmt::print(stderr, "usage: plumbline-rig-wakeups SECONDS: prints the share of a core\n");
    return 2;
  }
  const int processor = LastAllowedCpu();
  std::thread robot([processor] {
    SetRealTimePriority(kRobotPriority, "robot");
    PinThread(0, processor);
    Answer();
  });
  std::thread cycle([processor, seconds] {
    SetRealTimePriority(kCyclePriority, "cycle");
    PinThread(0, processor);
    Ask(100 * seconds);
  });
  cycle.join();
  robot.join();
  timespec busy{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &busy);
  fmt::print(
      "{:.5f}\n",
      (static_cast<double>(busy.tv_sec) + 1e-9 * static_cast<double>(busy.tv_nsec)) / seconds);
}
