#include "drivers/motion/egm_codec.h"

#include <catch2/catch.hpp>
#include <string>

#include "firmware-like/geometry/units.h"
#include "tests/motion_robots/egm_robot.h"

namespace plumbline::egm_codec_test {

using namespace plumbline::motion_link;
using motion_robots::EgmOptions;
using motion_robots::EgmRobot;
using motion_robots::MciState;

namespace {

const std::vector<double> kJoints = {10.5, -90.25, 91, 0, 45.0625, -179.9};

std::string Problem(const std::string& datagram) {
  RobotPacket packet;
  return std::string(EgmCodec(true).Parse(datagram, packet));
}

std::string Bytes(std::initializer_list<int> bytes) {
  std::string text;
  for (const int byte : bytes) text += static_cast<char>(byte);
  return text;
}

}  // namespace

TEST_CASE("a message of the robot is read, with and without its optional fields") {
  for (const bool packed : {false, true}) {
    for (const bool more_fields : {false, true}) {
      EgmOptions options;
      options.packed = packed;
      options.more_fields = more_fields;
      RobotPacket packet;
      REQUIRE(EgmCodec(true).Parse(EgmRobot(options).Packet(kJoints, 3000000000), packet).empty());
      CHECK(packet.number == 3000000000);
      CHECK(packet.running);
      REQUIRE(packet.q.size() == 6);
      for (int k = 0; k < 6; ++k) {
        CHECK(packet.q[k] ==
              Approx(kRadPerDeg * kJoints[static_cast<std::size_t>(k)]).margin(1e-15));
      }
    }
  }
}

TEST_CASE("the state of the interface decides whether corrections are applied") {
  const auto running = [](MciState state, bool needed) {
    EgmRobot robot({});
    robot.state = state;
    RobotPacket packet;
    REQUIRE(EgmCodec(needed).Parse(robot.Packet(kJoints, 1), packet).empty());
    return packet.running;
  };
  CHECK(running(MciState::kRunning, true));
  CHECK_FALSE(running(MciState::kStopped, true));
  CHECK_FALSE(running(MciState::kUndefined, true));
  CHECK(running(MciState::kStopped, false));
  CHECK_FALSE(running(MciState::kError, false));
}

TEST_CASE("joints that are not usable leave the packet without joints") {
  RobotPacket packet;
  const EgmRobot robot({});
  for (const std::vector<double>& joints :
       {std::vector<double>{}, {1, std::nan("")}, {HUGE_VAL}, std::vector<double>(13, 1.0)}) {
    REQUIRE(EgmCodec(true).Parse(robot.Packet(joints, 1), packet).empty());
    CHECK(packet.q.size() == 0);
  }
}

TEST_CASE("what is not a message of the robot is refused with the reason") {
  EgmRobot robot({});
  const std::string good = robot.Packet(kJoints, 7);
  CHECK(Problem(good).empty());
  for (std::size_t size = 1; size < good.size(); ++size) {
    const std::string problem = Problem(good.substr(0, size));
    CAPTURE(size);
    // A message cut between two fields is complete without the rest.
    CHECK((problem.empty() || problem == "not a message of EGM"));
  }
  CHECK(Problem("") == "the sequence number is missing");
  robot.message_type = 3;  // what a sensor sends
  CHECK(Problem(robot.Packet(kJoints, 7)) == "the message type is not that of a robot");
  robot.message_type.reset();
  CHECK(Problem(robot.Packet(kJoints, 7)) == "the message type is not that of a robot");
  CHECK(Problem(Bytes({0x0A, 0x7F})) == "not a message of EGM");      // longer than the rest
  CHECK(Problem(Bytes({0x0B, 0x0C})) == "not a message of EGM");      // a group
  CHECK(Problem(Bytes({0x02, 0x00})) == "not a message of EGM");      // field 0
  CHECK(Problem(std::string(11, '\xFF')) == "not a message of EGM");  // endless number
  CHECK(Problem("<Rob><IPOC>1</IPOC></Rob>") == "not a message of EGM");
}

TEST_CASE("the answer is a path correction, byte by byte") {
  RobotPacket packet;
  packet.number = 300;
  packet.time = 5;
  motion_offset::Offset offset;
  offset.translation = Vec3(0.001, 0, -0.002);
  std::array<char, 512> answer{};
  const std::size_t size = EgmCodec(true).Encode(packet, offset, answer);
  // header {seqno 300, tm 5, mtype PATH_CORRECTION}, pathCorr {pos {1, 0, -2} mm, age 0}
  const std::string expected =
      Bytes({0x0A, 7,  0x08, 0xAC, 0x02, 0x10, 5, 0x18, 4,                          //
             0x12, 31, 0x0A, 27,   0x09, 0,    0, 0,    0,    0,    0, 0xF0, 0x3F,  //
             0x11, 0,  0,    0,    0,    0,    0, 0,    0,                          //
             0x19, 0,  0,    0,    0,    0,    0, 0,    0xC0, 0x10, 0});
  CHECK(std::string(answer.data(), size) == expected);
}

TEST_CASE("a robot applies the answer during path correction, and refuses it in guidance") {
  RobotPacket packet;
  motion_offset::Offset offset;
  offset.translation = Vec3(0.0001, 0.0002, -0.0003);
  for (const bool guidance : {false, true}) {
    EgmOptions options;
    options.guidance = guidance;
    EgmRobot robot(options);
    REQUIRE(EgmCodec(true).Parse(robot.BeginCycle(), packet).empty());
    std::array<char, 512> answer{};
    const std::size_t size = EgmCodec(true).Encode(packet, offset, answer);
    robot.Receive({answer.data(), size});
    robot.EndCycle();
    CHECK(robot.refused() == (guidance ? 1 : 0));
    CHECK(motion_robots::Length(robot.offset().now()) == Approx(guidance ? 0 : std::sqrt(0.14)));
    if (!guidance) CHECK(robot.answered_seqno() == robot.number());
  }
}

}  // namespace plumbline::egm_codec_test
