#include "drivers/robot/push_codec.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "drivers/robot/modbus_robot.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/drivers/robot/small_profile.h"

namespace plumbline::push_codec_test {

using namespace plumbline::robot;

namespace {

PushPoint PointAt(const Vec3& p, int slot = 0, int id = 5) {
  PushPoint point;
  point.slot = slot;
  point.id = id;
  point.X_BT.p = p;
  point.valid = true;
  return point;
}

PushProfile Slots() {
  return *SmallProfile().push;
}

}  // namespace

TEST_CASE("a corrected point is encoded into the words of its slot") {
  const PushProfile slots = Slots();
  PushPoint point = PointAt({0.51234, -0.3, 1.2});
  point.X_BT.R = RotationFromVector({0.1, -0.2, 3.0});
  std::array<std::uint16_t, 8> words{};
  REQUIRE(RegistersFromPush(slots, point, 77, words) == PushFit::kFits);
  const std::array<std::uint16_t, 8> expected = {5,     5123, static_cast<std::uint16_t>(-3000),
                                                 12000, 100,  static_cast<std::uint16_t>(-200),
                                                 3000,  77};
  CHECK(words == expected);
}

TEST_CASE("32-bit slots use the word order of the profile") {
  PushProfile slots = Slots();
  slots.stride = 13;
  slots.id_place = std::nullopt;
  slots.pose_place = 0;
  slots.sequence_place = 12;
  slots.position_step_m = 1e-6;
  slots.angle_step_rad = 1e-6;
  slots.type = RegisterType::kInt32;
  std::array<std::uint16_t, 13> words{};
  REQUIRE(RegistersFromPush(slots, PointAt({0.070001, -1e-6, 0}), 1, words) == PushFit::kFits);
  CHECK(words[0] == 1);
  CHECK(words[1] == 70001 - 65536);
  CHECK(words[2] == 0xFFFF);
  CHECK(words[3] == 0xFFFF);
  slots.order = modbus::WordOrder::kCdab;
  REQUIRE(RegistersFromPush(slots, PointAt({0.070001, 0, 0}), 1, words) == PushFit::kFits);
  CHECK(words[0] == 70001 - 65536);
  CHECK(words[1] == 1);
  slots.type = RegisterType::kFloat32;
  slots.position_step_m = 1e-3;
  REQUIRE(RegistersFromPush(slots, PointAt({0.001, 0, 0}), 1, words) == PushFit::kFits);
  CHECK(words[0] == 0x0000);
  CHECK(words[1] == 0x3F80);
}

TEST_CASE("a point that does not fit is rejected, never wrapped") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  struct Row {
    const char* what;
    PushPoint point;
    PushFit fit;
  };
  const Row rows[] = {
      {"largest int16", PointAt({3.2767, 0, 0}), PushFit::kFits},
      {"smallest int16", PointAt({-3.2768, 0, 0}), PushFit::kFits},
      {"one step more", PointAt({3.2768, 0, 0}), PushFit::kOutOfRange},
      {"one step less", PointAt({0, -3.2769, 0}), PushFit::kOutOfRange},
      {"one turn of int16 more", PointAt({0, 0, 6.5536}), PushFit::kOutOfRange},
      {"10 km", PointAt({0, 0, 1e4}), PushFit::kOutOfRange},
      {"NaN", PointAt({nan, 0, 0}), PushFit::kNotFinite},
      {"infinite", PointAt({0, infinity, 0}), PushFit::kNotFinite},
      {"slot -1", PointAt(Vec3::Zero(), -1), PushFit::kNoSuchSlot},
      {"slot 3 of 3", PointAt(Vec3::Zero(), 3), PushFit::kNoSuchSlot},
      {"id 65536", PointAt(Vec3::Zero(), 0, 65536), PushFit::kBadId},
      {"id -1", PointAt(Vec3::Zero(), 0, -1), PushFit::kBadId},
  };
  for (const Row& row : rows) {
    std::array<std::uint16_t, 8> words{};
    INFO(row.what);
    CHECK(RegistersFromPush(Slots(), row.point, 1, words) == row.fit);
  }
  PushPoint point = PointAt(Vec3::Zero());
  point.X_BT.R(0, 0) = nan;
  std::array<std::uint16_t, 8> words{};
  CHECK(RegistersFromPush(Slots(), point, 1, words) == PushFit::kNotFinite);
  PushProfile fine = Slots();
  fine.angle_step_rad = 5e-5;  // pi is then 62832, beyond int16
  point.X_BT.R = RotationFromVector({3.1, 0, 0});
  CHECK(RegistersFromPush(fine, point, 1, words) == PushFit::kOutOfRange);
}

TEST_CASE("slots whose fields overlap or exceed the registers are unsound") {
  CHECK(IsConsistent(Slots()));
  struct Row {
    const char* what;
    void (*spoil)(PushProfile&);
  };
  const Row rows[] = {
      {"no slots", [](PushProfile& p) { p.slots = 0; }},
      {"slots beyond 65535", [](PushProfile& p) { p.first = 65530; }},
      {"slot too short", [](PushProfile& p) { p.stride = 7; }},
      {"slot too long", [](PushProfile& p) { p.stride = 124; }},
      {"sequence in the pose", [](PushProfile& p) { p.sequence_place = 3; }},
      {"id on the sequence", [](PushProfile& p) { p.id_place = 7; }},
      {"pose beyond the slot", [](PushProfile& p) { p.pose_place = 3; }},
      {"wide pose", [](PushProfile& p) { p.type = RegisterType::kInt32; }},
      {"step 0", [](PushProfile& p) { p.position_step_m = 0; }},
      {"step NaN", [](PushProfile& p) { p.angle_step_rad = std::nan(""); }},
  };
  for (const Row& row : rows) {
    PushProfile push = Slots();
    row.spoil(push);
    INFO(row.what);
    CHECK_FALSE(IsConsistent(push));
  }
}

namespace {

using Action = PushDecision::Action;

/// Requests an action from the gate and confirms it as done.
PushDecision AskAndDo(PushGate& gate, const std::vector<PushPoint>& points, double now_s) {
  PushDecision order = gate.Next(points, now_s);
  if (order.action == Action::kWrite) {
    gate.Written(order.point, now_s);
  } else if (order.action != Action::kNothing) {
    gate.Withdrawn(order.point.slot, now_s);
  }
  return order;
}

}  // namespace

TEST_CASE("a slot is written no faster than its period, slots round-robin") {
  PushGate gate(3, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  const std::vector<PushPoint> points = {PointAt({0, 0, 0}, 0), PointAt({1, 0, 0}, 1),
                                         PointAt({2, 0, 0}, 2)};
  CHECK(AskAndDo(gate, points, 0.00).point.slot == 0);
  CHECK(AskAndDo(gate, points, 0.01).point.slot == 1);
  CHECK(AskAndDo(gate, points, 0.02).point.slot == 2);
  CHECK(AskAndDo(gate, points, 0.03).action == Action::kNothing);
  CHECK(AskAndDo(gate, points, 0.09).action == Action::kNothing);
  CHECK(AskAndDo(gate, points, 0.11).point.slot == 0);
  CHECK(AskAndDo(gate, points, 0.25).point.slot == 1);
  CHECK(AskAndDo(gate, points, 0.26).point.slot == 2);
}

TEST_CASE("a jump withdraws the slot; it is written again once two requests agree") {
  PushGate gate(3, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  CHECK(AskAndDo(gate, {PointAt({0, 0, 0})}, 0).action == Action::kWrite);
  const PushDecision jump = AskAndDo(gate, {PointAt({0.006, 0, 0})}, 1);
  CHECK(jump.action == Action::kHold);
  CHECK(jump.step_m == Approx(0.006));
  SECTION("a real change") {
    CHECK(AskAndDo(gate, {PointAt({0.006, 0, 0})}, 1.01).action == Action::kNothing);
    const PushDecision settled = AskAndDo(gate, {PointAt({0.007, 0, 0})}, 1.11);
    CHECK(settled.action == Action::kWrite);
    CHECK(settled.point.X_BT.p.x() == Approx(0.007));
  }
  SECTION("a single wrong reading") {
    CHECK(AskAndDo(gate, {PointAt({0, 0, 0})}, 1.2).action == Action::kNothing);
    CHECK(AskAndDo(gate, {PointAt({0, 0, 0})}, 1.4).action == Action::kWrite);
  }
  SECTION("it is never steady") {
    for (int i = 0; i < 10; ++i) {
      const double x = i % 2 == 0 ? 0 : 0.006;
      CHECK(AskAndDo(gate, {PointAt({x, 0, 0})}, 2 + i).action == Action::kNothing);
    }
  }
  SECTION("not a number") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(AskAndDo(gate, {PointAt({nan, 0, 0})}, 2).action == Action::kNothing);
    CHECK(AskAndDo(gate, {PointAt({0, 0, 0})}, 3).action == Action::kNothing);
    CHECK(AskAndDo(gate, {PointAt({0, 0, 0})}, 4).action == Action::kWrite);
  }
  SECTION("another point takes the slot") {
    CHECK(AskAndDo(gate, {PointAt({0.5, 0, 0}, 0, 6)}, 2).action == Action::kWrite);
  }
}

TEST_CASE("a slow drift between two writes is announced as well") {
  PushGate gate(3, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  REQUIRE(AskAndDo(gate, {PointAt({0, 0, 0})}, 0).action == Action::kWrite);
  for (int i = 1; i <= 5; ++i) {
    const double x = 0.001 * i;
    CHECK(AskAndDo(gate, {PointAt({x, 0, 0})}, 0.01 * i).action == Action::kNothing);
  }
  const PushDecision held = AskAndDo(gate, {PointAt({0.006, 0, 0})}, 0.06);
  CHECK(held.action == Action::kHold);
  CHECK(held.step_m == Approx(0.006));
  CHECK(AskAndDo(gate, {PointAt({0.007, 0, 0})}, 0.07).action == Action::kNothing);
  CHECK(AskAndDo(gate, {PointAt({0.008, 0, 0})}, 0.17).action == Action::kWrite);
  // A step within the limit is written directly.
  CHECK(AskAndDo(gate, {PointAt({0.012, 0, 0})}, 0.28).action == Action::kWrite);
}

TEST_CASE("an invalid point is withdrawn once, before anything else is written") {
  PushGate gate(3, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  PushPoint invalid = PointAt({0, 0, 0}, 2);
  invalid.valid = false;
  const std::vector<PushPoint> points = {PointAt({0, 0, 0}, 0), invalid};
  const PushDecision first = AskAndDo(gate, points, 0);
  CHECK(first.action == Action::kWithdraw);  // left by an earlier run
  CHECK(first.point.slot == 2);
  CHECK(AskAndDo(gate, points, 0.01).action == Action::kWrite);
  CHECK(AskAndDo(gate, points, 0.02).action == Action::kNothing);
  gate.Reset();
  CHECK(AskAndDo(gate, points, 0.03).action == Action::kWithdraw);
  CHECK(AskAndDo(gate, points, 0.04).action == Action::kWrite);
}

TEST_CASE("a slot may hold a point from its first request until it is withdrawn") {
  PushGate gate(2, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  CHECK_FALSE(gate.MayHoldPoint(0));
  gate.Next(std::vector{PointAt({0, 0, 0}, 0)}, 0);
  CHECK(gate.MayHoldPoint(0));  // left by an earlier run
  CHECK_FALSE(gate.MayHoldPoint(1));
  gate.Withdrawn(0, 0);
  CHECK_FALSE(gate.MayHoldPoint(0));
  gate.Written(PointAt({0, 0, 0}), 1);
  CHECK(gate.MayHoldPoint(0));
  gate.Withdrawn(0, 2);
  gate.Reset();
  CHECK(gate.MayHoldPoint(0));
  CHECK_FALSE(gate.MayHoldPoint(1));
}

TEST_CASE("points without a slot are ignored") {
  PushGate gate(3, {.enabled = true, .max_step_m = 0.005, .min_period_s = 0.1});
  CHECK(AskAndDo(gate, {PointAt({0, 0, 0}, 3), PointAt({0, 0, 0}, -1)}, 0).action ==
        Action::kNothing);
}

}  // namespace plumbline::push_codec_test
