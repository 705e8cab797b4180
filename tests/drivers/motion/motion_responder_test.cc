// The responder on a wire where everything happens to packets that can happen to them.
#include "drivers/motion/motion_responder.h"

#include <catch2/catch.hpp>
#include <memory>

#include "tests/drivers/motion/virtual_client.h"
#include "tests/motion_robots/egm_robot.h"
#include "tests/motion_robots/rsi_robot.h"

namespace plumbline::motion_responder_test {

using motion_robots::HostileWire;
using status::MotionLinkState;

namespace {

constexpr double kResolution_mm = 2e-6, kResolution_deg = 4e-6;  // of the six decimals of an answer

std::unique_ptr<motion_robots::Controller> MakeController(const std::string& kind, bool hold_on) {
  if (kind == "egm") {
    motion_robots::EgmOptions options;
    options.applied.hold_on = hold_on;
    options.applied.pause_drops = !hold_on;
    return std::make_unique<motion_robots::EgmRobot>(options);
  }
  motion_robots::RsiOptions options;
  options.applied.hold_on = hold_on;
  return std::make_unique<motion_robots::RsiRobot>(options);
}

}  // namespace

TEST_CASE("on a quiet wire the offset is what the model demands") {
  for (const std::string kind : {"rsi", "egm"}) {
    CAPTURE(kind);
    const auto controller = MakeController(kind, true);
    test::VirtualClient client(test::VirtualSettings(kind, true));
    client.SetJoints({0, 20, 10, 0, 45, 0});
    HostileWire wire(*controller, client, {.trouble = 0});
    wire.Run(2000);
    const status::MotionLinkStatus status = client.responder().Status();
    CHECK(status.state == MotionLinkState::kCorrecting);
    CHECK(status.wanted_m > 1e-4);
    CHECK(motion_robots::Length(controller->offset().now()) == Approx(1e3 * status.offset_m));
    CHECK(status.offset_m == Approx(status.wanted_m).epsilon(0.02));
    CHECK(controller->offset().late() == 0);
    CHECK(status.lost + status.foreign + status.malformed + status.out_of_order == 0);
  }
}

TEST_CASE("no kind of trouble makes the applied offset jump, with HOLDON 1 and 0") {
  for (const std::string kind : {"rsi", "egm"}) {
    for (const bool hold_on : {true, false}) {
      for (int trouble = 0; trouble < static_cast<int>(motion_robots::kKinds); ++trouble) {
        CAPTURE(kind, hold_on, motion_robots::kHostileKinds[static_cast<std::size_t>(trouble)]);
        const motion_link::MotionSettings settings = test::VirtualSettings(kind, hold_on);
        const auto controller = MakeController(kind, hold_on);
        test::VirtualClient client(settings);
        client.SetJoints({0, 20, 10, 0, 45, 0});
        client.report().payload->mass_kg = hold_on ? 60 : 5;
        HostileWire wire(*controller, client, {.trouble = 0.004, .seed = 7});
        wire.Run(4000, trouble);
        CHECK(wire.happened()[static_cast<std::size_t>(trouble)] > 0);
        CHECK(controller->offset().largest_jump_mm() <=
              1e3 * settings.limits.max_jump_m + kResolution_mm);
        CHECK(controller->offset().largest_mm() <=
              1e3 * settings.limits.max_translation_m + kResolution_mm);
        CHECK(controller->offset().corrected() > 200);
        CHECK(controller->offset().largest_turn_deg() <=
              kDegPerRad * settings.limits.max_jump_rad + kResolution_deg);
        if (kind == "rsi") CHECK(controller->offset().turned() > 200);
      }
    }
  }
}

TEST_CASE("packets of others are counted, and change nothing") {
  test::VirtualClient client(test::VirtualSettings("rsi", true));
  motion_robots::RsiRobot robot({});
  client.Idle(1);
  const std::string packet = robot.BeginCycle();
  CHECK(client.Receive({{true, packet}}, 1.001).empty());
  CHECK(client.responder().Status().foreign == 1);
  CHECK(client.responder().Status().state == MotionLinkState::kWaiting);
  CHECK(client.Receive({{false, packet}}, 1.002).size() == 1);
  CHECK(client.Receive({{false, packet}}, 1.003).empty());
  CHECK(client.responder().Status().out_of_order == 1);
  CHECK(client.Receive({{false, "no packet"}}, 1.004).empty());
  CHECK(client.responder().Status().malformed == 1);
}

TEST_CASE("of packets that arrive together only the newest is answered") {
  test::VirtualClient client(test::VirtualSettings("egm", true));
  motion_robots::EgmRobot robot({});
  client.Idle(1);
  const std::string first = robot.BeginCycle(), second = robot.BeginCycle();
  const auto answers = client.Receive({{false, first}, {false, second}, {true, first}}, 1.1);
  REQUIRE(answers.size() == 1);
  robot.Receive(answers.front());
  CHECK(robot.answered_seqno() == robot.number());
  CHECK(client.responder().Status().superseded == 1);
}

TEST_CASE("a packet that waits for its answer has none if the stream is barred meanwhile") {
  for (const bool renumbered : {true, false}) {
    CAPTURE(renumbered);
    test::VirtualClient client(test::VirtualSettings("egm", true));
    motion_robots::EgmRobot robot({});
    robot.joints_deg = {0, 20, 10, 0, 45, 0};
    client.SetJoints(robot.joints_deg);
    double now_s = 1;
    client.Idle(now_s);
    for (int k = 0; k < 1500; ++k) {
      now_s += 0.004;
      for (const auto& answer : client.Receive({{false, robot.BeginCycle()}}, now_s))
        robot.Receive(answer);
      robot.EndCycle();
    }
    REQUIRE(motion_robots::Length(robot.offset().now()) > 0.1);
    robot.active = renumbered;
    std::vector<motion_robots::Client::Datagram> together = {{false, robot.BeginCycle()}};
    robot.active = true;
    if (renumbered) robot.Renumber(5000000);
    together.push_back({false, robot.BeginCycle()});
    together.push_back({false, robot.BeginCycle()});
    CHECK(client.Receive(together, now_s + 0.004).empty());
    CHECK(client.responder().Status().state == MotionLinkState::kNotAnswering);
  }
}

TEST_CASE("settings with which an offset could jump are refused") {
  motion_link::MotionSettings settings = test::VirtualSettings("rsi", true);
  CHECK(motion_link::MotionResponder::Create(settings, 0).ok());
  settings.limits.timeout_s = 1;
  CHECK_FALSE(motion_link::MotionResponder::Create(settings, 0).ok());
  settings = test::VirtualSettings("guidance", true);
  CHECK_FALSE(motion_link::MotionResponder::Create(settings, 0).ok());
  settings = test::VirtualSettings("rsi", true);
  settings.robot = "robot.lan";
  CHECK_FALSE(motion_link::MotionResponder::Create(settings, 0).ok());
}

}  // namespace plumbline::motion_responder_test
