#include "app/cell/daemon/cycle_affinity.h"

#include <sched.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

#include "drivers/real_time.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::cycle_affinity_test {

using namespace plumbline::cell;

namespace {

/// An idle thread, real-time (SCHED_FIFO) if requested and permitted.
class Idle {
 public:
  explicit Idle(bool real_time)
      : thread_([this, real_time] {
          if (real_time) SetRealTimePriority(kRobotPriority, "idle");
          heartbeat_.Beat();
          end_.wait(false);
        }) {
    while (heartbeat_.thread() == 0) std::this_thread::yield();
  }
  ~Idle() {
    end_ = true;
    end_.notify_one();
    thread_.join();
  }
  Idle(const Idle&) = delete;
  Idle& operator=(const Idle&) = delete;

  pid_t id() const { return heartbeat_.thread(); }
  bool real_time() const { return sched_getscheduler(id()) == SCHED_FIFO; }

 private:
  ThreadHeartbeat heartbeat_;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

int ProcessorsOf(pid_t thread) {
  cpu_set_t allowed;
  REQUIRE(sched_getaffinity(thread, sizeof allowed, &allowed) == 0);
  return CPU_COUNT(&allowed);
}

}  // namespace

TEST_CASE("real-time threads share a CPU until a cycle is late or cycles stop") {
  const Idle cycle(true), robot(true);
  if (!cycle.real_time() || kLocksSpin) {
    WARN("SKIPPED: no real-time priority here (ulimit -r), or a sanitizer");
    return;
  }
  const int all = ProcessorsOf(0);
  CycleAffinity affinity;
  const std::array both{cycle.id(), robot.id()};
  affinity.Update({10, 4, 0.01}, {cycle.id(), 0}, 100);  // the robot thread has not started
  CHECK(ProcessorsOf(cycle.id()) == 1);
  affinity.Update({20, 4, 0.01}, both, 100.1);
  CHECK(ProcessorsOf(robot.id()) == 1);
  CHECK(ProcessorsOf(0) == all);

  SECTION("a late cycle") {
    affinity.Update({30, 5, 0.01}, both, 100.2);
  }
  SECTION("no cycle") {
    affinity.Update({20, 4, 0.01}, both, 100.3);
    CHECK_FALSE(affinity.released());
    affinity.Update({20, 4, 0.01}, both, 100.5);
  }
  SECTION("no cycle, with a long period") {
    affinity.Update({20, 4, 1}, both, 102.9);
    CHECK_FALSE(affinity.released());
    affinity.Update({20, 4, 1}, both, 103.2);
  }
  CHECK(affinity.released());
  CHECK(ProcessorsOf(cycle.id()) == all);
  CHECK(ProcessorsOf(robot.id()) == all);
  affinity.Update({40, 5, 0.01}, both, 200);  // for good
  CHECK(ProcessorsOf(cycle.id()) == all);
}

TEST_CASE("threads that are not real-time are not pinned") {
  const Idle cycle(false), robot(false);
  const int all = ProcessorsOf(0);
  CycleAffinity affinity;
  affinity.Update({10, 0, 0.01}, {cycle.id(), robot.id()}, 1);
  CHECK(ProcessorsOf(cycle.id()) == all);
}

}  // namespace plumbline::cycle_affinity_test
