#include "app/cell/daemon/thread_watchdog.h"

#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <thread>
#include <vector>

#include "app/cell/daemon/device_wait.h"

namespace plumbline::thread_watchdog_test {

using plumbline::cell::IsWaitingForDevice;
using plumbline::cell::ThreadWatchdog;

TEST_CASE("a thread whose heartbeat stops is reported after its timeout") {
  std::uint64_t cycle = 0, images = 7;
  ThreadWatchdog watchdog;
  watchdog.Add("cycle", 2, [&] { return cycle; });
  watchdog.Add("images", 10, [&] { return images; });

  CHECK(watchdog.Check(100).name.empty());  // counts from the first check
  CHECK(watchdog.Check(102).name.empty());
  CHECK(watchdog.Check(102.1).name == "cycle");
  CHECK(watchdog.Check(104).silent_s == Approx(4));
  ++cycle;
  CHECK(watchdog.Check(104.5).name.empty());
  CHECK(watchdog.Check(106).name.empty());
  for (int k = 0; k < 10; ++k) {
    ++cycle;
    CHECK(watchdog.Check(106 + 0.4 * k).name.empty());
  }
  ++cycle;
  CHECK(watchdog.Check(110.1).name == "images");
}

TEST_CASE(
    "of several stalled threads the first one added is reported: the one that others wait for") {
  ThreadWatchdog watchdog;
  watchdog.Add("a", 3, [] { return 1; });
  watchdog.Add("b", 1, [] { return 1; });
  watchdog.Check(0);
  CHECK(watchdog.Check(2).name == "b");
  CHECK(watchdog.Check(4).name == "a");
}

TEST_CASE("a thread that waits for a device is excused, up to the device timeout") {
  bool in_device = true;
  ThreadWatchdog watchdog;
  watchdog.Add(
      "journal", 5, [] { return 1; }, [&] { return in_device; });
  int now_s = 0;
  const auto check_until = [&](int end_s) {
    std::string thread;
    for (; now_s <= end_s; ++now_s) thread = watchdog.Check(now_s).name;
    return thread;
  };
  CHECK(check_until(20).empty());
  in_device = false;  // the device has answered, but the thread hangs
  CHECK(check_until(25).empty());
  CHECK(check_until(26) == "journal");
  in_device = true;
  CHECK(check_until(35).empty());
  CHECK(check_until(36) == "journal");  // no device takes that long
  CHECK(watchdog.Check(36).silent_s == Approx(36));
}

TEST_CASE("a changed timeout applies from the next check on") {
  ThreadWatchdog watchdog;
  watchdog.Add("robot link", 2, [] { return 1; });
  watchdog.Check(0);
  watchdog.SetTimeout("robot link", 60);
  CHECK(watchdog.Check(50).name.empty());
  CHECK(watchdog.Check(61).name == "robot link");
}

TEST_CASE("a thread in uninterruptible sleep is recognised, a sleeping one is not") {
  std::atomic<pid_t> waiting{0}, resting{0};
  std::atomic<bool> ends{false};
  int release[2];
  REQUIRE(pipe(release) == 0);
  const auto child = [](void* pipe) {
    char byte = 0;
    return static_cast<int>(read(*static_cast<int*>(pipe), &byte, 1));
  };
  // A vfork() parent is in uninterruptible sleep until the child exits [vfork(2), clone(2)].
  std::thread waits([&] {
    waiting = gettid();
    std::vector<std::byte> stack(std::size_t{1} << 16U);
    const pid_t pid =
        clone(child, stack.data() + stack.size(), CLONE_VM | CLONE_VFORK | SIGCHLD, release);
    waitpid(pid, nullptr, 0);
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  std::thread rests([&] {
    resting = gettid();
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  const auto comes = [&](bool wanted) {
    for (int k = 0; k < 20000; ++k) {
      if (waiting != 0 && IsWaitingForDevice(waiting) == wanted) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  };
  CHECK(comes(true));
  while (resting == 0) std::this_thread::yield();
  CHECK_FALSE(IsWaitingForDevice(resting));
  CHECK(write(release[1], "x", 1) == 1);
  CHECK(comes(false));
  ends = true;
  waits.join();
  rests.join();
  CHECK_FALSE(IsWaitingForDevice(0));
  close(release[0]);
  close(release[1]);
}

}  // namespace plumbline::thread_watchdog_test
