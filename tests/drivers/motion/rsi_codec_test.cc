#include "drivers/motion/rsi_codec.h"

#include <catch2/catch.hpp>
#include <string>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "tests/motion_robots/rsi_robot.h"

namespace plumbline::rsi_codec_test {

using namespace plumbline::motion_link;

namespace {

const std::vector<double> kJoints = {10.5, -90.25, 91, 0, 45.0625, -179.9};

std::string Problem(const std::string& datagram) {
  RobotPacket packet;
  return std::string(RsiCodec({}).Parse(datagram, packet));
}

std::string Answered(std::uint64_t number, const motion_offset::Offset& offset,
                     const RsiNames& names = {}) {
  RobotPacket packet;
  packet.number = number;
  std::array<char, 512> answer{};
  const std::size_t size = RsiCodec(names).Encode(packet, offset, answer);
  return {answer.data(), size};
}

}  // namespace

TEST_CASE("a packet is read whatever the order, the spaces and the further elements") {
  for (int oddity = 0; oddity < 210; ++oddity) {
    CAPTURE(oddity);
    motion_robots::RsiOptions options;
    options.oddity = oddity;
    motion_robots::RsiRobot robot(options);
    RobotPacket packet;
    CHECK(RsiCodec({}).Parse(robot.Packet(kJoints, 4208163634), packet).empty());
    CHECK(packet.number == 4208163634);
    CHECK(packet.running);
    CHECK(packet.late == 0);
    REQUIRE(packet.q.size() == 6);
    for (int k = 0; k < 6; ++k) {
      CHECK(packet.q[k] == Approx(kRadPerDeg * kJoints[static_cast<std::size_t>(k)]).margin(1e-12));
    }
  }
}

TEST_CASE("the published example of a packet is read") {
  RobotPacket packet;
  REQUIRE(RsiCodec({})
              .Parse("<Rob Type=\"KUKA\"><RIst X=\"1.0\" Y=\"2.0\" Z=\"3.0\" A=\"4.0\" B=\"5.0\" "
                     "C=\"6.0\"/><AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" "
                     "A6=\"0.0\"/><Delay D=\"3\"/><IPOC>123645634563</IPOC></Rob>",
                     packet)
              .empty());
  CHECK(packet.number == 123645634563);
  CHECK(packet.late == 3);
  CHECK(packet.q[1] == Approx(-90 * kRadPerDeg));
}

TEST_CASE("joints that are missing or not numbers leave the packet without joints") {
  for (const char* joints : {"", "<AIPos/>", "<AIPos A1=\"1\" A3=\"3\"/>", "<AIPos A1=\"nan\"/>",
                             "<AIPos A1=\"inf\"/>", "<AIPos A1=\"1,5\"/>", "<AIPos A1=\"1e999\"/>",
                             "<AIPos A1=\"\"/>", "<AIPos A0=\"1\"/>", "<Other A1=\"1\"/>"}) {
    CAPTURE(joints);
    RobotPacket packet;
    CHECK(
        RsiCodec({}).Parse(std::string("<Rob>") + joints + "<IPOC>7</IPOC></Rob>", packet).empty());
    CHECK(packet.number == 7);
    CHECK(packet.q.size() == 0);
  }
}

TEST_CASE("what is not a packet of RSI is refused with the reason") {
  CHECK(Problem("<Rob><IPOC>1</IPOC></Rob>").empty());
  CHECK(Problem("") == "not the XML of RSI");
  CHECK(Problem("<Rob/>") == "IPOC is missing");
  CHECK(Problem("<Sen><IPOC>1</IPOC></Sen>") == "the element is not Rob");
  CHECK(Problem("<Rob><IPOC>-1</IPOC></Rob>") == "IPOC is not a whole number");
  CHECK(Problem("<Rob><IPOC>99999999999999999999</IPOC></Rob>") == "IPOC is not a whole number");
  CHECK(Problem("<Rob><IPOC>1</IPOC><IPOC>1</IPOC></Rob>") == "an element or a joint occurs twice");
  CHECK(Problem("<Rob><AIPos A1='1' A1='2'/><IPOC>1</IPOC></Rob>") ==
        "an element or a joint occurs twice");
  CHECK(Problem(std::string(9000, ' ')) == "too long");
  for (const char* text :
       {"<Rob><IPOC>1</IPOC>", "<Rob><IPOC>1</IPOC></Rob><Rob/>", "<Rob><IPOC>1</Rob></IPOC>",
        "text<Rob><IPOC>1</IPOC></Rob>", "<Rob><IPOC>1</IPOC></Rob>text", "<!DOCTYPE Rob><Rob/>",
        "<Rob><![CDATA[]]><IPOC>1</IPOC></Rob>", "<Rob><a><b><c><d/></c></b></a></Rob>",
        "<Rob a=1><IPOC>1</IPOC></Rob>", "<Rob a=\"<\"><IPOC>1</IPOC></Rob>",
        "<?xml?><?xml?><Rob><IPOC>1</IPOC></Rob>", "</Rob>", "<Rob", "<"}) {
    CAPTURE(text);
    CHECK(Problem(text) == "not the XML of RSI");
  }
}

TEST_CASE("the answer has the controller's names, millimetres and degrees") {
  motion_offset::Offset offset;
  offset.translation = Vec3(0.001, -0.00025, 1.23456789e-6);
  CHECK(Answered(99, offset) ==
        "<Sen Type=\"ImFree\"><RKorr X=\"1.000000\" Y=\"-0.250000\" Z=\"0.001235\" A=\"0.000000\" "
        "B=\"0.000000\" C=\"0.000000\"/><IPOC>99</IPOC></Sen>");
  offset = {};
  offset.rotation = VectorFromRotation(
      (Eigen::AngleAxisd(0.03, Vec3::UnitZ()) * Eigen::AngleAxisd(0.02, Vec3::UnitY()) *
       Eigen::AngleAxisd(0.01, Vec3::UnitX()))
          .toRotationMatrix());
  const std::string turned = Answered(1, offset, {"Plumb", "AIPos", "RK2"});
  CHECK(turned.find("<Sen Type=\"Plumb\"><RK2 ") == 0);
  CHECK(turned.find("A=\"1.718873\" B=\"1.145916\" C=\"0.572958\"") != std::string::npos);
}

TEST_CASE("the longest answer fits") {
  const std::string name(kLongestRsiName, 'n');
  motion_offset::Offset offset;
  offset.translation = Vec3::Constant(-0.02);
  offset.rotation = Vec3::Constant(-0.05);
  const std::string answer = Answered(~std::uint64_t{0}, offset, {name, name, name});
  CHECK(answer.ends_with("<IPOC>18446744073709551615</IPOC></Sen>"));
}

}  // namespace plumbline::rsi_codec_test
