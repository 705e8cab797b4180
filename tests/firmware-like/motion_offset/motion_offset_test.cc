// Tests of the offset's state machine, among them random histories of packets between it and a
// controller that keeps or drops the last value.
#include "firmware-like/motion_offset/motion_offset.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <random>

namespace plumbline::motion_offset_test {

using namespace plumbline::motion_offset;

namespace {

constexpr double kCycle_s = 0.004;

OffsetLimits Limits() {
  OffsetLimits limits;
  limits.max_translation_m = 0.002;
  limits.max_rotation_rad = 0.01;
  limits.rate_m_per_s = 0.004;
  limits.max_jump_m = 0.0002;
  limits.max_jump_rad = 0.001;
  limits.cycle_s = kCycle_s;
  limits.timeout_s = 0.04;
  limits.ramp_s = 0.5;
  return limits;
}

MotionOffset::Order Wanted(double x_m, double turn_rad = 0) {
  MotionOffset::Order order;
  order.wanted.translation = Vec3(x_m, 0, 0);
  order.wanted.rotation = Vec3(0, turn_rad, 0);
  return order;
}

MotionOffset::Order Refused(Obstacle obstacle) {
  MotionOffset::Order order;
  order.obstacle = obstacle;
  return order;
}

/// A stream without disturbance, begun after a silence.
struct Stream {
  MotionOffset offset{Limits(), 100};
  double now_s = 101;
  std::uint64_t number = 5000;
  bool accepted = false;

  Stream() { offset.Idle(now_s); }
  const Offset& Next(const MotionOffset::Order& order, bool running = true, int steps = 1) {
    now_s += kCycle_s * steps;
    number += 4U * static_cast<unsigned>(steps);
    const MotionOffset::Packet packet{now_s, number, running};
    accepted = offset.Accept(packet).accepted;
    offset.Next(order);
    return offset.offset();
  }
  void Run(const MotionOffset::Order& order, double time_s) {
    for (int k = 0; k < std::lround(time_s / kCycle_s); ++k) Next(order);
  }
  double x() const { return offset.offset().translation.x(); }
};

}  // namespace

TEST_CASE("an offset rises from 0 with ramp and rate, and stays at what is wanted") {
  Stream stream;
  CHECK(stream.Next(Wanted(0.001)).zero());  // the first packet: nothing may move yet
  double before = 0, steepest = 0;
  for (int k = 0; k < 250; ++k) {
    stream.Next(Wanted(0.001));
    steepest = std::max(steepest, stream.x() - before);
    before = stream.x();
  }
  CHECK(stream.x() == 0.001);
  CHECK(steepest <= Limits().rate_m_per_s * kCycle_s * (1 + 1e-9));
  CHECK(stream.offset.obstacle() == Obstacle::kNone);
}

TEST_CASE("a refusal ramps out, missing data are bridged for a moment") {
  Stream stream;
  stream.Run(Wanted(0.001), 2);
  stream.Run(Refused(Obstacle::kRobotNotTrusted), 0.15);
  CHECK(stream.x() == 0.001);
  stream.Run(Refused(Obstacle::kRobotNotTrusted), 1);
  CHECK(stream.x() == 0);
  stream.Run(Wanted(0.001), 2);
  stream.Run(Refused(Obstacle::kNotEnabled), 2 * kCycle_s);
  CHECK(stream.x() < 0.001);
  stream.Run(Refused(Obstacle::kNotEnabled), 1);
  CHECK(stream.x() == 0);
}

TEST_CASE("an offset beyond its limit or not a number is refused, not clipped") {
  for (const double wanted : {0.0021, -0.5, std::nan(""), HUGE_VAL}) {
    Stream stream;
    stream.Run(Wanted(0.001), 2);
    stream.Run(Wanted(wanted), 1);
    CHECK(stream.offset.obstacle() == Obstacle::kTooLarge);
    CHECK(stream.x() == 0);
  }
}

TEST_CASE("a rotation is limited in the same share as the translation") {
  Stream stream;
  double before = 0, steepest = 0;
  for (int k = 0; k < 500; ++k) {
    const double now = stream.Next(Wanted(0, 0.009)).rotation.y();
    steepest = std::max(steepest, now - before);
    before = now;
  }
  CHECK(before == 0.009);
  CHECK(steepest <= 0.01 * (0.004 / 0.002) * kCycle_s * (1 + 1e-9));
}

TEST_CASE("a stream that ran before the program is not answered until it has ended") {
  MotionOffset offset(Limits(), 100);
  CHECK_FALSE(offset.Accept({100.001, 4}).accepted);
  CHECK_FALSE(offset.Accept({100.3, 8}).accepted == false);  // after a silence: another stream
}

TEST_CASE("a stream interrupted for too long is not answered until it has ended") {
  Stream stream;
  stream.Run(Wanted(0.001), 2);
  stream.Next(Wanted(0.001), true, 4);  // three packets lost
  CHECK(stream.accepted);
  CHECK(stream.x() == 0.001);
  stream.Next(Wanted(0.001), true, 8);  // seven packets lost, or a packet of something else
  CHECK_FALSE(stream.accepted);
  stream.Next(Wanted(0.001));
  CHECK_FALSE(stream.accepted);
  CHECK(stream.offset.obstacle() == Obstacle::kNotAnswered);
  stream.Run(Wanted(0.001), 1);
  CHECK_FALSE(stream.accepted);
  stream.now_s += 1;  // the controller has stopped, and starts again
  stream.Next(Wanted(0.001));
  CHECK(stream.accepted);
  CHECK(stream.x() == 0);
}

TEST_CASE("a pause within the timeout is an interruption even if the numbers continue") {
  Stream stream;
  stream.Run(Wanted(0.001), 2);
  stream.now_s += 8 * kCycle_s;
  stream.Next(Wanted(0.001));
  CHECK_FALSE(stream.accepted);
}

TEST_CASE("a controller that pauses its corrections and resumes them is not trusted to be at 0") {
  Stream stream;
  stream.Run(Wanted(0.001), 2);
  stream.Next(Wanted(0.001), false);
  CHECK(stream.accepted);
  CHECK(stream.offset.obstacle() == Obstacle::kNotRunning);
  stream.Next(Wanted(0.001), true);
  CHECK_FALSE(stream.accepted);
}

TEST_CASE("limits that cannot prevent a jump have a fault") {
  OffsetLimits limits = Limits();
  CHECK(FaultOf(limits) == LimitsFault::kNone);
  limits.timeout_s = 0.4;
  CHECK(FaultOf(limits) == LimitsFault::kJumpsAfterLosses);
  limits = Limits();
  limits.holds_last = false;
  limits.max_rotation_rad = 0;
  CHECK(FaultOf(limits) == LimitsFault::kJumpsToZero);
  limits.max_translation_m = limits.max_jump_m;
  CHECK(FaultOf(limits) == LimitsFault::kNone);
  limits.timeout_s = 0;
  CHECK(FaultOf(limits) == LimitsFault::kTimeoutTooShort);
}

TEST_CASE("limits with which the rotation could jump have a fault") {
  OffsetLimits limits = Limits();
  limits.max_rotation_rad = 0.08;
  CHECK(FaultOf(limits) == LimitsFault::kTurnsAfterLosses);
  limits.holds_last = false;
  limits.max_translation_m = limits.max_jump_m;
  CHECK(FaultOf(limits) == LimitsFault::kTurnsToZero);
  limits.max_rotation_rad = limits.max_jump_rad;
  CHECK(FaultOf(limits) == LimitsFault::kNone);
}

TEST_CASE("limits with which the way back to 0 outlasts a stop have a fault") {
  OffsetLimits limits = Limits();
  limits.ramp_s = kLongestReturn_s + 0.1;
  CHECK(FaultOf(limits) == LimitsFault::kReturnsTooLate);
  limits = Limits();
  limits.rate_m_per_s = limits.max_translation_m / (kLongestReturn_s + 0.1);
  CHECK(FaultOf(limits) == LimitsFault::kReturnsTooLate);
}

TEST_CASE("a packet that waits for its answer has none if the stream is barred meanwhile") {
  for (const bool pauses : {true, false}) {
    CAPTURE(pauses);
    Stream stream;
    stream.Run(Wanted(0.001), 2);
    const double now_s = stream.now_s + kCycle_s;
    const std::uint64_t next = stream.number + 4;
    REQUIRE(stream.offset.Accept({now_s, next, !pauses}).accepted);
    REQUIRE(stream.offset.unanswered());
    const std::uint64_t other = next + (pauses ? 0 : 1000000);
    CHECK_FALSE(stream.offset.Accept({now_s, other + 4, true}).accepted);
    CHECK_FALSE(stream.offset.Accept({now_s, other + 8, true}).accepted);
    CHECK_FALSE(stream.offset.Next(Wanted(0.001)));
  }
}

TEST_CASE("a correction that paused with an offset is not resumed even after the way to 0") {
  Stream stream;
  stream.Run(Wanted(0.001), 2);
  for (int k = 0; k < 500; ++k) stream.Next(Wanted(0.001), false);
  CHECK(stream.accepted);
  CHECK(stream.x() == 0);
  stream.Next(Wanted(0.001), true);
  CHECK_FALSE(stream.accepted);
}

TEST_CASE("packets that come steadily faster or slower than the configured cycle are named") {
  for (const double step_s : {12 * kCycle_s, 3 * kCycle_s, 0.3 * kCycle_s}) {
    CAPTURE(step_s);
    OffsetLimits limits = Limits();
    limits.timeout_s = 0.045;
    MotionOffset offset(limits, 100);
    offset.Idle(101);
    double now_s = 101;
    std::uint64_t number = 7;
    for (int k = 0; k < 600; ++k) {
      now_s += step_s;
      if (offset.Accept({now_s, number += 4, true}).accepted) offset.Next(Wanted(0.001));
    }
    CHECK(offset.obstacle() == Obstacle::kWrongCycle);
    CHECK(offset.offset().zero());
  }
  Stream stream;
  for (int k = 0; k < 2000; ++k) stream.Next(Wanted(0.001), true, k % 7 == 0 ? 3 : 1);
  CHECK(stream.offset.obstacle() == Obstacle::kNone);
}

namespace {

/// A controller that sends a packet per cycle, applies the answer to it if that arrives within the
/// cycle, and stops after too many answers in a row were missing.
struct Controller {
  bool holds_last = true;
  int tolerated = 0;
  std::uint64_t number = 1000;
  int missing = 0;
  Offset applied;
  double pause_s = 0;  ///< until its next start

  void Apply(const Offset* answer) {
    if (answer != nullptr) {
      applied = *answer;
      missing = 0;
      return;
    }
    if (!holds_last) applied = {};
    if (++missing > tolerated) pause_s = 0.04;
  }
};

struct Worst {
  double jump = 0, size = 0;  ///< in shares of their limits
  std::uint64_t applied = 0;  ///< cycles with an offset
};

/// Random packets lost, late, doubled, reordered and foreign, random orders, deaths of the program.
Worst RandomHistory(unsigned seed, bool holds_last, int cycles) {
  std::mt19937 random(seed);
  const auto chance = [&random](double p) { return std::bernoulli_distribution(p)(random); };
  OffsetLimits limits = Limits();
  limits.holds_last = holds_last;
  if (!holds_last) {
    limits.max_translation_m = limits.max_jump_m;
    limits.max_rotation_rad = limits.max_jump_rad;
  }
  Controller robot;
  robot.holds_last = holds_last;
  robot.tolerated = static_cast<int>(std::lround(limits.timeout_s / limits.cycle_s));
  double now_s = 50;
  MotionOffset offset(limits, now_s);
  now_s += 1;
  std::deque<MotionOffset::Packet> late;
  MotionOffset::Order order = Wanted(0.001);
  Worst worst;
  double trouble = 0;
  for (int k = 0; k < cycles; ++k) {
    now_s += kCycle_s;
    if (robot.pause_s > 0) {
      robot.pause_s -= kCycle_s;
      offset.Idle(now_s);
      if (robot.pause_s <= 0)
        robot = {robot.holds_last, robot.tolerated, robot.number + 4, 0, {}, 0};
      continue;
    }
    if (k % 500 == 0) trouble = chance(0.3) ? 0.3 : chance(0.5) ? 0.02 : 0.7;
    if (chance(0.01)) {
      const double size =
          std::uniform_real_distribution(0.0, 1.2)(random) * limits.max_translation_m;
      order = chance(0.1) ? Refused(static_cast<Obstacle>(chance(0.5) ? 10 : 5))
                          : Wanted(size, size * limits.max_rotation_rad / limits.max_translation_m);
    }
    if (chance(0.0005)) offset = MotionOffset(limits, now_s);  // killed and started again
    robot.number += 4;
    const Offset before = robot.applied;
    const Offset* answer = nullptr;
    Offset held;
    const auto deliver = [&](const MotionOffset::Packet& packet) {
      if (!offset.Accept(packet).accepted) return;
      held = offset.Next(order).value();
      if (packet.number == robot.number && !chance(0.5 * trouble)) answer = &held;
    };
    if (chance(0.3 * trouble)) deliver({now_s, robot.number + 77777});  // foreign
    if (chance(trouble * 0.2)) {
      late.push_back({now_s, robot.number});
    } else if (!chance(trouble * 0.3)) {
      deliver({now_s, robot.number});
      if (chance(trouble)) deliver({now_s + 1e-4, robot.number});
    }
    while (!late.empty() && chance(0.4)) {
      late.front().received_s = now_s + 2e-4;
      deliver(late.front());
      late.pop_front();
    }
    robot.Apply(answer);
    const double jump = (robot.applied.translation - before.translation).norm();
    const double turn = (robot.applied.rotation - before.rotation).norm();
    worst.jump = std::max({worst.jump, jump / limits.max_jump_m, turn / limits.max_jump_rad});
    worst.size = std::max(worst.size, robot.applied.translation.norm() / limits.max_translation_m);
    if (!robot.applied.zero()) ++worst.applied;
  }
  return worst;
}

}  // namespace

TEST_CASE("no history of packets makes an applied offset jump or exceed its limit") {
  for (const bool holds_last : {true, false}) {
    std::uint64_t applied = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      CAPTURE(holds_last, seed);
      const Worst worst = RandomHistory(seed, holds_last, 10000);
      CHECK(worst.jump <= 1 + 1e-9);
      CHECK(worst.size <= 1 + 1e-9);
      applied += worst.applied;
    }
    CHECK(applied > 10000);  // the histories are not all refusals
  }
}

}  // namespace plumbline::motion_offset_test
