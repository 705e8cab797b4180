// Counts allocations: a successful reading and push allocate nothing. Runs in a separate process.
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "drivers/robot/registry.h"
#include "tests/drivers/robot/fake_controller.h"
#include "tests/drivers/robot/small_profile.h"
#include "tests/drivers/robot/test_time.h"
#include "tests/virtual_ur/running_ur.h"

namespace {

thread_local long g_allocations = 0;  // per thread, so that the controller's are not counted

}  // namespace

// Out of line, because the compiler reports an inlined free as a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
  ++g_allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory, const std::nothrow_t& /*tag*/) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace plumbline::allocation_test {

using namespace plumbline::robot;

TEST_CASE("successful reading and pushing allocate nothing") {
  FakeController controller;
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", controller.port()};
  connection.timeout_s = 1;
  connection.profile = SmallProfile();
  connection.push.enabled = true;
  connection.clock = TestTime;
  auto robot = MakeRobot("tcp", connection);
  REQUIRE(robot.ok());
  model::RobotState state;
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);

  std::array<PushPoint, 3> points;
  for (int i = 0; i < 3; ++i) {
    points[static_cast<std::size_t>(i)].slot = i;
    points[static_cast<std::size_t>(i)].valid = true;
  }
  const long before = g_allocations;
  LinkResult worst = LinkResult::kOk;
  for (int i = 0; i < 100; ++i) {
    points[0].X_BT.p.x() = 1e-3 * i;
    Advance(0.06);
    if (robot.value()->Read(state) != LinkResult::kOk) worst = LinkResult::kLost;
    const LinkResult pushed = robot.value()->Push(points);
    if (pushed != LinkResult::kOk) worst = pushed;
  }
  const long after = g_allocations;
  CHECK(worst == LinkResult::kOk);
  CHECK(controller.Get(101) > 0);
  CHECK(after - before == 0);
}

TEST_CASE("successful reading and pushing over RTDE allocate nothing") {
  virtual_ur::RunningUr controller;
  RobotConnection connection;
  connection.tcp = {"127.0.0.1", controller.port()};
  connection.timeout_s = 2;
  connection.rtde.frequency_hz = 500;
  connection.push.enabled = true;
  connection.pushed_points = 3;
  auto robot = MakeRobot("rtde", connection);
  REQUIRE(robot.ok());
  model::RobotState state;
  REQUIRE(robot.value()->Read(state) == LinkResult::kOk);
  std::array<PushPoint, 3> points;
  for (int i = 0; i < 3; ++i) {
    points[static_cast<std::size_t>(i)].slot = i;
    points[static_cast<std::size_t>(i)].valid = true;
  }
  const std::uint64_t first = state.sequence;
  const long before = g_allocations;
  LinkResult worst = LinkResult::kOk;
  while (worst == LinkResult::kOk && state.sequence < first + 100) {
    points[0].X_BT.p.x() += 1e-6;
    if (robot.value()->Read(state) != LinkResult::kOk) worst = LinkResult::kLost;
    if (const LinkResult pushed = robot.value()->Push(points); pushed != LinkResult::kOk)
      worst = pushed;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const long after = g_allocations;
  CHECK(worst == LinkResult::kOk);
  CHECK(controller.State().input_int[24] > 0);
  CHECK(after - before == 0);
}

}  // namespace plumbline::allocation_test
