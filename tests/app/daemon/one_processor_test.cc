#include "app/daemon/one_processor.h"

#include <sched.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

#include "drivers/pulse.h"
#include "drivers/real_time.h"

using namespace plumbline;

namespace {

/// A thread that does nothing until its end, first in, first out where it shall and may be.
class Idle {
 public:
  explicit Idle(bool real_time)
      : thread_([this, real_time] {
          if (real_time) MakeRealTime(kRobotPriority, "idle");
          pulse_.Beat();
          end_.wait(false);
        }) {
    while (pulse_.thread() == 0) std::this_thread::yield();
  }
  ~Idle() {
    end_ = true;
    end_.notify_one();
    thread_.join();
  }
  Idle(const Idle&) = delete;
  Idle& operator=(const Idle&) = delete;

  pid_t number() const { return pulse_.thread(); }
  bool real_time() const { return sched_getscheduler(number()) == SCHED_FIFO; }

 private:
  Pulse pulse_;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

int ProcessorsOf(pid_t thread) {
  cpu_set_t allowed;
  REQUIRE(sched_getaffinity(thread, sizeof allowed, &allowed) == 0);
  return CPU_COUNT(&allowed);
}

}  // namespace

TEST_CASE("real-time threads share a processor until a cycle is late or none comes") {
  const Idle cycle(true), robot(true);
  if (!cycle.real_time() || kLocksSpin) {
    WARN("SKIPPED: no real-time priority here (ulimit -r), or a sanitizer");
    return;
  }
  const int all = ProcessorsOf(0);
  OneProcessor processor;
  const std::array both{cycle.number(), robot.number()};
  processor.Look({10, 4, 0.01}, {cycle.number(), 0}, 100);  // the robot's has not begun
  CHECK(ProcessorsOf(cycle.number()) == 1);
  processor.Look({20, 4, 0.01}, both, 100.1);
  CHECK(ProcessorsOf(robot.number()) == 1);
  CHECK(ProcessorsOf(0) == all);

  SECTION("a late cycle") {
    processor.Look({30, 5, 0.01}, both, 100.2);
  }
  SECTION("no cycle") {
    processor.Look({20, 4, 0.01}, both, 100.3);
    CHECK_FALSE(processor.let_go());
    processor.Look({20, 4, 0.01}, both, 100.5);
  }
  SECTION("no cycle, of slow ones") {
    processor.Look({20, 4, 1}, both, 102.9);
    CHECK_FALSE(processor.let_go());
    processor.Look({20, 4, 1}, both, 103.2);
  }
  CHECK(processor.let_go());
  CHECK(ProcessorsOf(cycle.number()) == all);
  CHECK(ProcessorsOf(robot.number()) == all);
  processor.Look({40, 5, 0.01}, both, 200);  // for good
  CHECK(ProcessorsOf(cycle.number()) == all);
}

TEST_CASE("threads that are not real-time go where the scheduler wants") {
  const Idle cycle(false), robot(false);
  const int all = ProcessorsOf(0);
  OneProcessor processor;
  processor.Look({10, 0, 0.01}, {cycle.number(), robot.number()}, 1);
  CHECK(ProcessorsOf(cycle.number()) == all);
}
