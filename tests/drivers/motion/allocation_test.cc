// Counts allocations: answering a packet allocates nothing. Runs in a separate process.
#include <array>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "tests/drivers/motion/virtual_client.h"
#include "tests/motion_robots/egm_robot.h"
#include "tests/motion_robots/rsi_robot.h"

namespace {

thread_local long g_allocations = 0;

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

namespace plumbline::motion_allocation_test {

using namespace plumbline::motion_link;

TEST_CASE("answering packets allocates nothing") {
  for (const std::string kind : {"rsi", "egm"}) {
    CAPTURE(kind);
    motion_robots::RsiRobot rsi({});
    motion_robots::EgmRobot egm({});
    motion_robots::Controller& robot =
        kind == "rsi" ? static_cast<motion_robots::Controller&>(rsi) : egm;
    robot.joints_deg = {0, 20, 10, 0, 45, 0};
    std::vector<std::string> packets;
    for (int k = 0; k < 200; ++k) packets.push_back(robot.BeginCycle());
    test::VirtualClient client(test::VirtualSettings(kind, true));
    client.SetJoints(robot.joints_deg);
    client.report().now_s = 10;
    const motion_offset::MotionModel model{1, {test::StiffArm(), {}}};
    MotionResponder responder =
        MotionResponder::Create(test::VirtualSettings(kind, true), 0).value();
    responder.Idle(5);
    std::uint32_t address = 0;
    inet_pton(AF_INET, "192.0.2.7", &address);
    std::array<char, 512> answer{};
    double now_s = 10;
    const long before = g_allocations;
    int answered = 0;
    for (const std::string& packet : packets) {
      now_s += 0.001;
      if (!responder.Take(address, packet, now_s)) continue;
      responder.Answer(client.report(), &model, false, answer);
      ++answered;
    }
    const long after = g_allocations;
    CHECK(answered == 200);
    CHECK(responder.Status().state == status::MotionLinkState::kCorrecting);
    CHECK(after - before == 0);
  }
}

}  // namespace plumbline::motion_allocation_test
