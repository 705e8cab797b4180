// The motion link over real sockets, with a controller on 127.0.0.1.
#include "drivers/motion/motion_link.h"

#include <catch2/catch.hpp>
#include <functional>
#include <string>

#include "drivers/clock.h"
#include "tests/drivers/motion/virtual_client.h"
#include "tests/motion_robots/rsi_robot.h"
#include "tests/motion_robots/udp_peer.h"

namespace plumbline::motion_link_test {

using namespace plumbline::motion_link;
using status::MotionLinkState;

namespace {

bool Eventually(const std::function<bool()>& condition) {
  for (int wait = 0; wait < 6000; ++wait) {
    if (condition()) return true;
    SleepSeconds(0.005);
  }
  return false;
}

/// Patient limits: nothing here depends on the speed of the machine.
MotionSettings Settings() {
  MotionSettings settings = test::VirtualSettings("rsi", true);
  settings.listen = "127.0.0.1";
  settings.robot = "127.0.0.1";
  settings.port = 0;
  settings.limits.timeout_s = 0.2;
  settings.limits.max_jump_m = 0.005;
  settings.limits.max_jump_rad = 0.05;
  settings.limits.max_lost = 50;
  return settings;
}

struct Running {
  std::unique_ptr<MotionLink> link;
  motion_robots::RsiRobot robot{{}};
  motion_robots::UdpPeer peer;

  explicit Running(const MotionSettings& settings = Settings())
      : link(MotionLink::Create(settings).value()) {
    link->UseModel(std::make_shared<const motion_offset::MotionModel>(
        motion_offset::MotionModel{1, {test::StiffArm(), {}}}));
    link->Start();
    REQUIRE(Eventually([this] { return link->port() != 0; }));
    robot.joints_deg = {0, 20, 10, 0, 45, 0};
  }
  void Report(bool enabled = true) const {
    motion_offset::CycleReport report;
    report.now_s = report.q_s = MonotonicSeconds();
    report.generation = 1;
    report.enabled = enabled;
    report.plc_alive = report.robot_trusted = true;
    report.q.resize(6);
    report.q << 0, 20, 10, 0, 45, 0;
    report.q *= kRadPerDeg;
    report.payload = loads::Payload{60, Vec3(0.02, 0.05, 1.1)};
    report.radius = {0.0003, model::RadiusBasis::kMeasured};
    link->Report(report);
  }
  /// A cycle of the controller. @return  whether it was answered
  bool Cycle(bool enabled = true) {
    Report(enabled);
    peer.Send(robot.BeginCycle(), link->port());
    const std::string answer = peer.Receive(1000);
    if (!answer.empty()) robot.Receive(answer);
    robot.EndCycle();
    return !answer.empty();
  }
  void AwaitSilence() const {
    REQUIRE(Eventually([this] { return link->heartbeat().beats() > 8; }));
    SleepSeconds(0.3);
  }
};

}  // namespace

TEST_CASE("the link answers, corrects, and returns to 0 when it is stopped") {
  Running running;
  running.AwaitSilence();
  REQUIRE(running.Cycle());
  CHECK(running.robot.wrong_ipoc() == 0);
  REQUIRE(Eventually([&] {
    running.Cycle();
    return running.link->Status().state == MotionLinkState::kCorrecting &&
           motion_robots::Length(running.robot.offset().now()) > 0.05;
  }));
  running.link->RequestStop();
  REQUIRE(Eventually([&] {
    if (running.link->ended()) return true;
    running.Report();
    running.peer.Send(running.robot.BeginCycle(), running.link->port());
    if (const std::string answer = running.peer.Receive(100); !answer.empty())
      running.robot.Receive(answer);
    running.robot.EndCycle();
    return false;
  }));
  CHECK(motion_robots::Length(running.robot.offset().now()) == 0);
  std::uint64_t counted = 0;
  for (const std::uint64_t count : running.link->answers().counts) counted += count;
  CHECK(counted == running.link->Status().answered);
}

TEST_CASE("a stream that runs already is not answered") {
  Running running;
  running.peer.Send(running.robot.BeginCycle(), running.link->port());
  CHECK(running.peer.Receive(100).empty());
  CHECK(Eventually([&] { return running.link->Status().state == MotionLinkState::kNotAnswering; }));
}

TEST_CASE("packets from another address are not answered") {
  Running running;
  running.AwaitSilence();
  const motion_robots::UdpPeer other("127.0.0.2");
  other.Send(running.robot.BeginCycle(), running.link->port());
  CHECK(other.Receive(50).empty());
  CHECK(Eventually([&] { return running.link->Status().foreign == 1; }));
  CHECK(running.Cycle());
}

TEST_CASE("a flood from another address is dropped by the kernel, and the controller is answered") {
  Running running;
  running.AwaitSilence();
  const motion_robots::UdpPeer other("127.0.0.2");
  const std::string packet = running.robot.BeginCycle();
  CHECK(Eventually([&] {
    for (int k = 0; k < 5000; ++k) other.Send(packet, running.link->port());
    SleepSeconds(0.1);
    const std::uint64_t before = running.link->Status().foreign;
    for (int k = 0; k < 100; ++k) other.Send(packet, running.link->port());
    SleepSeconds(0.2);
    return before > 0 && running.link->Status().foreign == before;
  }));
  CHECK(running.Cycle());
}

TEST_CASE("a port that is in use is reported, and opened once it is free") {
  auto first = std::make_unique<Running>();
  MotionSettings settings = Settings();
  settings.port = first->link->port();
  auto link = MotionLink::Create(settings).value();
  link->Start();
  CHECK(Eventually([&] { return link->Status().state == MotionLinkState::kNoSocket; }));
  CHECK(link->problem().find(std::to_string(settings.port)) != std::string::npos);
  first.reset();
  CHECK(Eventually([&] { return link->port() == settings.port; }));
  CHECK(link->problem().empty());
  CHECK(Eventually([&] { return link->Status().state == MotionLinkState::kWaiting; }));
}

}  // namespace plumbline::motion_link_test
