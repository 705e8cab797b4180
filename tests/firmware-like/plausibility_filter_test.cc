#include "firmware-like/plausibility_filter.h"

#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::plausibility_filter_test {

namespace {

struct Stream {
  model::CellModel cell = test::HeavyArm();
  deflection::LoadedArm arm{cell};
  PlausibilityFilter filter{PlausibilityLimits{}};
  model::RobotState state;
  double now_s = 100;
  std::optional<int> mounted;

  Stream() {
    state.q = model::JointVector::Zero(6);
    state.q[4] = 0.5;
  }

  InputFault Next() {
    now_s += 0.01;
    state.timestamp_s = now_s;
    ++state.sequence;
    return filter.Check(arm, state, now_s, mounted);
  }
  InputFault Trusted() {
    Next();
    Next();
    return Next();
  }
};

}  // namespace

/// The value of a float32 [deg] whose four bytes a wrong profile takes in another order [rad].
double Misread(double q_rad, const std::array<int, 4>& order) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(q_rad * kDegPerRad));
  std::uint32_t taken = 0;
  for (const int byte : order) taken = taken << 8 | (bits >> (24 - 8 * byte) & 0xFF);
  return kRadPerDeg * static_cast<double>(std::bit_cast<float>(taken));
}

TEST_CASE("joints read in a wrong order of words or bytes are hardly ever trusted") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> angle(-2, 2);
  int wrong = 0, tried = 0;
  for (const std::array<int, 4>& order : {std::array{2, 3, 0, 1}, {1, 0, 3, 2}, {3, 2, 1, 0}}) {
    for (const double step_deg : {0.0, 0.001, 0.125, 1.0}) {  // what a display rounds to
      for (int k = 0; k < 2000; ++k, ++tried) {
        Stream stream;
        for (double& q : stream.state.q) {
          q = angle(random);
          if (step_deg > 0) q = kRadPerDeg * step_deg * std::round(q * kDegPerRad / step_deg);
          q = Misread(q, order);
        }
        wrong += stream.Trusted() == InputFault::kOk ? 1 : 0;
      }
    }
  }
  CAPTURE(wrong, tried);
  CHECK(wrong <= tried / 1000);
}

TEST_CASE("subnormal values are no reading, and neither is all zero without a pose") {
  const auto trusted = [](std::initializer_list<double> q_deg, bool pose) {
    Stream stream;
    for (int j = 0; j < 6; ++j) stream.state.q[j] = kRadPerDeg * *(q_deg.begin() + j);
    kinematics::Posture posture;
    stream.arm.chain().Evaluate(stream.state.q, posture);
    if (pose) stream.state.X_BT = posture.X_BF();
    return stream.Trusted();
  };
  CHECK(trusted({2.3e-41, 7e-41, 5e-41, 6e-41, 7e-41, 1e-42}, false) == InputFault::kTooSmall);
  CHECK(trusted({12, 7e-41, 5, 6, 7, 1}, true) == InputFault::kTooSmall);
  CHECK(trusted({0, 0, 0, 0, 0, 0}, false) == InputFault::kAllZero);
  CHECK(trusted({0, 1e-15, -0.0, 0, 0, 0}, false) == InputFault::kAllZero);
  CHECK(trusted({0, 0, 0, 0, 0, 0}, true) == InputFault::kOk);  // the pose confirms it
  CHECK(trusted({0, 0, 0, 0, 0.01, 0}, false) == InputFault::kOk);
  CHECK(trusted({0, 1e-17, 0, 0, 30, 0}, false) == InputFault::kOk);  // rounding of a controller
  // A robot that was seen elsewhere may be sent to zero.
  Stream stream;
  stream.state.q[4] = 0.02;
  REQUIRE(stream.Trusted() == InputFault::kOk);
  stream.state.q[4] = 0;
  CHECK(stream.Trusted() == InputFault::kOk);
  // Registers of a controller that has restarted are zero until the robot is referenced.
  CHECK(stream.filter.Check(stream.arm, stream.state, stream.now_s + 30) == InputFault::kStale);
  stream.now_s += 30;
  CHECK(stream.Trusted() == InputFault::kAllZero);
  stream.state.q[4] = 0.02;
  CHECK(stream.Trusted() == InputFault::kOk);
  CHECK(std::string(RemedyOf(InputFault::kAllZero)).find("move a joint") == 0);
}

TEST_CASE("a controller that reports coupled joints with the right pose is trusted if declared") {
  // Joint 3 is counted against the ground: its axis is at q3 + q2.
  model::JointVector axes(6);
  axes << 0.3, 0.4, -0.9, 0.2, 0.6, -0.5;
  kinematics::Posture posture;
  kinematics::Chain(test::HeavyArm().robot).Evaluate(axes, posture);
  for (const bool declared : {true, false}) {
    Stream stream;
    if (declared) stream.cell.robot.couplings = {{2, 1, 1.0}};
    const deflection::LoadedArm arm(stream.cell);
    stream.state.q = axes;
    stream.state.q[2] -= axes[1];
    stream.state.X_BT = posture.X_BF();
    InputFault fault = InputFault::kMissing;
    for (int reading = 0; reading < 3; ++reading) {
      stream.state.timestamp_s = stream.now_s += 0.01;
      ++stream.state.sequence;
      fault = stream.filter.Check(arm, stream.state, stream.now_s, {});
    }
    CHECK(fault == (declared ? InputFault::kOk : InputFault::kTcpMismatch));
  }
}

TEST_CASE("trust requires three consecutive good readings") {
  Stream stream;
  CHECK(stream.filter.Check(stream.arm, stream.state, 100) == InputFault::kMissing);
  CHECK(stream.Next() == InputFault::kMissing);
  CHECK(stream.Next() == InputFault::kMissing);
  CHECK(stream.Next() == InputFault::kOk);
}

TEST_CASE("implausible readings are rejected, and trust returns automatically") {
  struct Case {
    const char* name;
    InputFault fault;
    std::function<void(model::RobotState&)> spoil;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Case cases[] = {
      {"a joint is not a number", InputFault::kNotFinite,
       [&](model::RobotState& s) { s.q[2] = nan; }},
      {"a joint is infinite", InputFault::kNotFinite,
       [&](model::RobotState& s) { s.q[2] = 1 / 0.0; }},
      {"a joint outside its limits", InputFault::kJointLimit,
       [](model::RobotState& s) { s.q[4] = 2.3; }},
      {"a joint jumps", InputFault::kJump, [](model::RobotState& s) { s.q[0] += 0.5; }},
      {"a joint is missing", InputFault::kJointCount,
       [](model::RobotState& s) { s.q = model::JointVector::Zero(5); }},
      {"the tool pose is not a number", InputFault::kNotFinite,
       [&](model::RobotState& s) {
         s.X_BT = Pose();
         s.X_BT->p.x() = nan;
       }},
      {"the tool pose is 10 m away", InputFault::kTcpMismatch,
       [](model::RobotState& s) {
         s.X_BT = Pose();
         s.X_BT->p.x() = 10;
       }},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    Stream stream;
    REQUIRE(stream.Trusted() == InputFault::kOk);
    const model::RobotState good = stream.state;
    c.spoil(stream.state);
    CHECK(stream.Next() == c.fault);
    const auto sequence = stream.state.sequence;
    stream.state = good;
    stream.state.sequence = sequence;
    CHECK(stream.Next() != InputFault::kOk);
    stream.Trusted();
    CHECK(stream.Next() == InputFault::kOk);
  }
}

TEST_CASE("registers refreshed every 100 ms are not mistaken for jumps") {
  Stream stream;
  REQUIRE(stream.Trusted() == InputFault::kOk);
  for (int cycle = 0; cycle < 200; ++cycle) {
    if (cycle % 10 == 0) stream.state.q[0] += cycle < 100 ? 0.2 : -0.2;  // 115 deg/s
    CAPTURE(cycle);
    REQUIRE(stream.Next() == InputFault::kOk);
  }
  // Even after a long standstill, more than a joint can move in the slowest refresh is a jump.
  for (int cycle = 0; cycle < 100; ++cycle) stream.Next();
  stream.state.q[0] += 2;
  CHECK(stream.Next() == InputFault::kJump);
}

TEST_CASE("a reading becomes stale, and fresh ones must regain trust") {
  Stream stream;
  REQUIRE(stream.Trusted() == InputFault::kOk);
  CHECK(stream.filter.Check(stream.arm, stream.state, stream.now_s + 0.099) == InputFault::kOk);
  CHECK(stream.filter.Check(stream.arm, stream.state, stream.now_s + 0.101) == InputFault::kStale);
  stream.now_s += 5;
  CHECK(stream.Next() == InputFault::kStale);
  CHECK(stream.Next() == InputFault::kStale);
  CHECK(stream.Next() == InputFault::kOk);
}

TEST_CASE("the reported tool pose is compared with forward kinematics according to the profile") {
  Stream stream;
  kinematics::Posture posture;
  stream.arm.chain().Evaluate(stream.state.q, posture);
  const Pose X_BF = posture.X_BF();
  SECTION("no pose reported: not checked") {
    CHECK(stream.Trusted() == InputFault::kOk);
    CHECK_FALSE(stream.filter.decoding_checked());
  }
  SECTION("the cell's tool") {
    stream.state.X_BT = X_BF * stream.arm.X_FT();
  }
  SECTION("the flange") {
    stream.state.X_BT = X_BF;
    stream.state.tcp_is_flange = true;
  }
  SECTION("a reported tool offset") {
    stream.state.X_FT = Pose{RotationFromVector({0.1, 0.2, 0.3}), Vec3(0.3, 0, 0.2)};
    stream.state.X_BT = X_BF * *stream.state.X_FT;
  }
  if (stream.state.X_BT) {
    CHECK(stream.Trusted() == InputFault::kOk);
    CHECK(stream.filter.decoding_checked());
    stream.state.X_BT->p.z() = -stream.state.X_BT->p.z();  // a sign decoded the wrong way
    CHECK(stream.Next() ==
          InputFault::kOk);  // may have been sampled at another time than the joints
    CHECK(stream.Next() == InputFault::kOk);
    CHECK(stream.Next() == InputFault::kTcpMismatch);
  }
}

TEST_CASE("the reported tool pose must be that of the tool whose number is reported") {
  Stream stream;
  stream.cell.tool.number = 4;
  stream.cell.further_tools = {stream.cell.tool};
  stream.cell.further_tools[0].number = 7;
  stream.cell.further_tools[0].tcp_F.z() += 0.3;
  stream.arm = deflection::LoadedArm(stream.cell);
  kinematics::Posture posture;
  stream.arm.chain().Evaluate(stream.state.q, posture);
  stream.state.X_BT = posture.X_BF() * stream.arm.X_FT(1);
  const auto after_three = [&](std::optional<int> mounted) {
    stream.mounted = mounted;
    return stream.Trusted();
  };
  CHECK(after_three(1) == InputFault::kOk);
  CHECK_FALSE(stream.filter.tip_of_other_tool());
  CHECK(after_three(0) == InputFault::kTcpMismatch);
  CHECK(stream.filter.tip_of_other_tool() == 1);
  CHECK(after_three(std::nullopt) == InputFault::kOk);  // no declared number is reported
  stream.state.X_BT = posture.X_BF();
  CHECK(after_three(0) == InputFault::kOk);  // no tool offset is set in the controller
  stream.state.X_BT->p.z() -= 3;
  CHECK(after_three(0) == InputFault::kTcpMismatch);
  CHECK_FALSE(stream.filter.tip_of_other_tool());
}

}  // namespace plumbline::plausibility_filter_test
