#include "app/daemon/lifeline.h"

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

#include "app/daemon/device_wait.h"

using plumbline::Lifeline;
using plumbline::WaitsForDevice;

TEST_CASE("a thread that comes round is alive, one that stands still is named after its patience") {
  std::uint64_t cycle = 0, images = 7;
  Lifeline lifeline;
  lifeline.Add("cycle", 2, [&] { return cycle; });
  lifeline.Add("images", 10, [&] { return images; });

  CHECK(lifeline.Look(100).thread.empty());  // counts from the first look
  CHECK(lifeline.Look(102).thread.empty());
  CHECK(lifeline.Look(102.1).thread == "cycle");
  CHECK(lifeline.Look(104).for_s == Approx(4));
  ++cycle;
  CHECK(lifeline.Look(104.5).thread.empty());
  CHECK(lifeline.Look(106).thread.empty());
  for (int k = 0; k < 10; ++k) {
    ++cycle;
    CHECK(lifeline.Look(106 + 0.4 * k).thread.empty());
  }
  ++cycle;
  CHECK(lifeline.Look(110.1).thread == "images");
}

TEST_CASE(
    "where several stand still the first one added is named: what others wait for comes first") {
  Lifeline lifeline;
  lifeline.Add("a", 3, [] { return 1; });
  lifeline.Add("b", 1, [] { return 1; });
  lifeline.Look(0);
  CHECK(lifeline.Look(2).thread == "b");
  CHECK(lifeline.Look(4).thread == "a");
}

TEST_CASE("a thread that waits for a device is excused, for as long as a device may take") {
  bool waits = true;
  Lifeline lifeline;
  lifeline.Add(
      "journal", 5, [] { return 1; }, [&] { return waits; });
  int now_s = 0;
  const auto looked_until = [&](int end_s) {
    std::string thread;
    for (; now_s <= end_s; ++now_s) thread = lifeline.Look(now_s).thread;
    return thread;
  };
  CHECK(looked_until(20).empty());
  waits = false;  // it came back from the device, and hangs
  CHECK(looked_until(25).empty());
  CHECK(looked_until(26) == "journal");
  waits = true;
  CHECK(looked_until(35).empty());
  CHECK(looked_until(36) == "journal");  // no device takes that long
  CHECK(lifeline.Look(36).for_s == Approx(36));
}

TEST_CASE("another patience holds from the next look on") {
  Lifeline lifeline;
  lifeline.Add("robot link", 2, [] { return 1; });
  lifeline.Look(0);
  lifeline.SetPatience("robot link", 60);
  CHECK(lifeline.Look(50).thread.empty());
  CHECK(lifeline.Look(61).thread == "robot link");
}

TEST_CASE("the kernel tells a thread that waits where no signal wakes it from one that rests") {
  std::atomic<pid_t> waiting{0}, resting{0};
  std::atomic<bool> ends{false};
  int let_go[2];
  REQUIRE(pipe(let_go) == 0);
  const auto child = [](void* pipe) {
    char byte = 0;
    return static_cast<int>(read(*static_cast<int*>(pipe), &byte, 1));
  };
  // Who makes a child that borrows its memory sleeps so until the child ends [vfork(2), clone(2)].
  std::thread waits([&] {
    waiting = gettid();
    std::vector<std::byte> stack(std::size_t{1} << 16U);
    const pid_t pid =
        clone(child, stack.data() + stack.size(), CLONE_VM | CLONE_VFORK | SIGCHLD, let_go);
    waitpid(pid, nullptr, 0);
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  std::thread rests([&] {
    resting = gettid();
    while (!ends) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  const auto comes = [&](bool wanted) {
    for (int k = 0; k < 20000; ++k) {
      if (waiting != 0 && WaitsForDevice(waiting) == wanted) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  };
  CHECK(comes(true));
  while (resting == 0) std::this_thread::yield();
  CHECK_FALSE(WaitsForDevice(resting));
  CHECK(write(let_go[1], "x", 1) == 1);
  CHECK(comes(false));
  ends = true;
  waits.join();
  rests.join();
  CHECK_FALSE(WaitsForDevice(0));
  close(let_go[0]);
  close(let_go[1]);
}
