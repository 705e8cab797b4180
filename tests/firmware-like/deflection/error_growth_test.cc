// Predictive variance of a fitted model beyond what was measured, and the share that is applied.
#include "firmware-like/deflection/error_growth.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "firmware-like/deflection/loaded_arm.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::error_growth_test {

using namespace plumbline::deflection;
using Input = DomainExit::Input;

namespace {

constexpr double kNear_m = 1e-4, kPosture_m = 1e-3;                                    // per radian
constexpr double kPayload_m = 1e-5, kTemp_m = 2e-5, kTime_m = 1e-8, kTorque_m = 2e-6;  // per unit

/// A heavy arm that was measured in one posture, with a growth along every input.
model::CellModel Fitted() {
  model::CellModel cell = test::HeavyArm();
  model::Domain& domain = cell.domain.emplace();
  domain.q.assign(6, model::Interval{-1, 1});
  domain.payload_kg = model::MeasuredRange{{{0, 40}}, kPayload_m};
  domain.temp_C = model::MeasuredRange{{{20, 25}}, kTemp_m};
  domain.t_s = model::MeasuredRange{{{0, 3600}}, kTime_m};
  domain.torques = {{1, {{{0, 50}}, kTorque_m}}, {4, {{{-20, 5}}, kTorque_m}}};
  domain.residual_sigma_m = kNear_m;
  domain.distant_sigma_m = kPosture_m;
  domain.poses = {model::JointVector::Zero(6)};
  return cell;
}

/// The same, of a correction whose causes are not confirmed.
model::CellModel Fading(double declared_m) {
  model::CellModel cell = Fitted();
  cell.domain->declared_sigma_m = declared_m;
  return cell;
}

/// A point within everything that was measured.
OperatingPoint Measured() {
  return {.q = model::JointVector::Zero(6),
          .payload_kg = 20,
          .temp_C = 22,
          .t_s = 1800,
          .tau = model::JointVector::Zero(6)};
}

OperatingPoint With(const std::function<void(OperatingPoint&)>& change) {
  OperatingPoint point = Measured();
  change(point);
  return point;
}

ErrorGrowth GrowthOf(const model::CellModel& cell) {
  return LoadedArm(cell).growth();
}

double Squared(double value) {
  return value * value;
}

}  // namespace

TEST_CASE("the variance is the sum of the squared growths along each input") {
  const model::CellModel cell = Fitted();
  const LoadedArm arm(cell);
  const ErrorGrowth& growth = arm.growth();
  CHECK(growth.Variance(Measured()) == 0);
  CHECK(growth.Share(Measured()) == 1);
  CHECK_FALSE(growth.fades());
  const auto turned = [](OperatingPoint& at) { at.q[0] = 0.5; };
  const double d =
      kinematics::PoseDistance(arm.chain(), arm.X_FT().p, cell.domain->poses).Of(With(turned).q);
  const struct {
    std::function<void(OperatingPoint&)> change;
    double gained_m;
  } cases[] = {{turned, kPosture_m * d},
               {[](OperatingPoint& at) { at.payload_kg = 45; }, kPayload_m * 5},
               {[](OperatingPoint& at) { at.temp_C = 17; }, kTemp_m * 3},
               {[](OperatingPoint& at) { at.t_s = 7200; }, kTime_m * 3600},
               {[](OperatingPoint& at) { at.tau[1] = 60; }, kTorque_m * 10},
               {[](OperatingPoint& at) { at.tau[4] = 12; }, kTorque_m * 7}};
  OperatingPoint all = Measured();
  double sum_m2 = 0;
  for (const auto& one : cases) {
    CHECK(growth.Variance(With(one.change)) == Approx(Squared(one.gained_m)));
    one.change(all);
    sum_m2 += Squared(one.gained_m);
  }
  CHECK(growth.Variance(all) == Approx(sum_m2));
  CHECK(growth.Share(all) == 1);
}

TEST_CASE("a joint beyond its range adds by how far it moves the tip") {
  constexpr double kRange_m = 4e-4;
  model::CellModel cell = Fitted();
  cell.domain->q[1] = {0.5, 0.6};
  cell.domain->reach_rad = 10;  // without the distance of the posture
  const LoadedArm arm(cell);
  const kinematics::PoseDistance from(arm.chain(), arm.X_FT().p, cell.domain->poses);
  const OperatingPoint beyond = With([](OperatingPoint& at) { at.q << 1.5, 0.7, 0, 0, 0, 0; });
  CHECK(arm.growth().Variance(beyond) == 0);
  cell.domain->range_growth_m = kRange_m;
  const double of_first = from.lever(0) * 0.5, of_second = from.lever(1) * 0.1;
  CHECK(GrowthOf(cell).Variance(beyond) ==
        Approx(Squared(kRange_m) * (Squared(of_first) + Squared(of_second))));
  CHECK(GrowthOf(cell).Variance(With([](OperatingPoint& at) { at.q[1] = 0.55; })) == 0);
}

TEST_CASE("three measured loads are three values, not a range") {
  model::CellModel cell = Fitted();
  cell.domain->payload_kg->intervals = {{0, 0}, {20, 20}, {60, 60}};
  const ErrorGrowth growth = GrowthOf(cell);
  const std::pair<double, double> cases[] = {{0, 0},  {20, 0},  {60, 0}, {8, 8},
                                             {12, 8}, {45, 15}, {70, 10}};
  for (const auto& one : cases) {
    const double payload_kg = one.first, beyond_kg = one.second;
    CAPTURE(payload_kg);
    const double variance_m2 =
        growth.Variance(With([&](OperatingPoint& at) { at.payload_kg = payload_kg; }));
    CHECK(variance_m2 == Approx(Squared(kPayload_m * beyond_kg)));
  }
}

TEST_CASE("a torque has a sign, and one that is not known adds nothing") {
  const ErrorGrowth growth = GrowthOf(Fitted());
  const auto gained_m = [&](Eigen::Index joint, double tau_Nm) {
    return std::sqrt(growth.Variance(With([&](OperatingPoint& at) { at.tau[joint] = tau_Nm; })));
  };
  CHECK(gained_m(1, 30) == 0);
  CHECK(gained_m(1, -30) == Approx(kTorque_m * 30));
  CHECK(gained_m(4, -20) == 0);
  CHECK(gained_m(4, 20) == Approx(kTorque_m * 15));
  CHECK(gained_m(0, -500) == 0);  // no range is stated for this joint
  CHECK(growth.Variance(With([](OperatingPoint& at) { at.tau.resize(0); })) == 0);
}

TEST_CASE("what is not known of a point adds no variance") {
  const OperatingPoint unknown{.q = model::JointVector::Zero(6), .t_s = 0};
  CHECK(GrowthOf(Fitted()).Variance(unknown) == 0);
  CHECK_FALSE(GrowthOf(Fitted()).Outside(unknown));
}

TEST_CASE("an unconfirmed correction fades by the share S^2 / (S^2 + E^2) along every input") {
  constexpr double kDeclared_m = 3e-4;
  model::CellModel cell = Fading(kDeclared_m);
  const ErrorGrowth growth = GrowthOf(cell);
  CHECK(growth.fades());
  CHECK(growth.Share(Measured()) == 1);
  const OperatingPoint beyond = With([](OperatingPoint& at) {
    at.payload_kg = 60;
    at.tau[1] = -100;
  });
  const double gained_m2 = Squared(kPayload_m * 20) + Squared(kTorque_m * 100);
  const double share = Squared(kDeclared_m) / (Squared(kDeclared_m) + gained_m2);
  CHECK(growth.Share(beyond) == Approx(share));
  CHECK(growth.Variance(beyond) == Approx(share * gained_m2));
  // What is kept with the distance is kept of what is applied at the measured poses.
  cell.domain->applied_share = 0.6;
  CHECK(GrowthOf(cell).Share(Measured()) == 0.6);
  CHECK(GrowthOf(cell).Share(beyond) == Approx(0.6 * share));
  CHECK(GrowthOf(cell).Variance(beyond) == Approx(share * gained_m2));
  cell.domain->applied_share = 1;
  // Far away, nothing is applied: no worse than without a correction.
  CHECK(growth.Variance(With([](OperatingPoint& at) { at.t_s = 1e12; })) ==
        Approx(Squared(kDeclared_m)));
  // The postures count from the reach.
  const OperatingPoint turned = With([](OperatingPoint& at) { at.q[0] = 0.5; });
  CHECK(growth.Share(turned) < 1);
  cell.domain->reach_rad = 0.5;  // one joint of several: d < 0.5
  CHECK(GrowthOf(cell).Share(turned) == 1);
}

TEST_CASE("an input without a growth is outside at any distance, and its error is not described") {
  for (const double declared_m : {0.0, 3e-4}) {
    CAPTURE(declared_m);
    model::CellModel cell = declared_m > 0 ? Fading(declared_m) : Fitted();
    cell.domain->payload_kg->growth.reset();
    const ErrorGrowth growth = GrowthOf(cell);
    CHECK_FALSE(growth.Outside(With([](OperatingPoint& at) { at.payload_kg = 40; })));
    CHECK(growth.Describes(With([](OperatingPoint& at) { at.payload_kg = 40; })));
    const OperatingPoint beyond = With([](OperatingPoint& at) { at.payload_kg = 40.001; });
    CHECK(growth.Outside(beyond));
    CHECK_FALSE(growth.Describes(beyond));
  }
  model::CellModel propagated = Fitted();
  propagated.domain->residual_sigma_m.reset();  // nothing was validated
  CHECK_FALSE(GrowthOf(propagated).Describes(Measured()));
}

TEST_CASE("nothing of a fading correction is left for what was not measured at all") {
  constexpr double kDeclared_m = 3e-4;
  model::CellModel cell = Fading(kDeclared_m);
  cell.tool.number = 4;
  cell.further_tools = {cell.tool};
  cell.further_tools[0].number = 7;
  cell.payload_items = {{2, 5, Vec3::Zero()}};
  cell.domain->tools = {4};
  cell.domain->payload_items = {0};
  const OperatingPoint tool = With([](OperatingPoint& at) { at.tool = 1; });
  const OperatingPoint item = With([](OperatingPoint& at) { at.item = 2; });
  CHECK(GrowthOf(cell).Share(Measured()) == 1);
  for (const OperatingPoint& point : {tool, item}) {
    const ErrorGrowth growth = GrowthOf(cell);
    CHECK(growth.Share(point) == 0);
    CHECK(growth.Variance(point) == Approx(Squared(kDeclared_m)));
    CHECK(growth.Outside(point));
  }
  cell.domain->payload_kg.reset();  // the rows did not record their loads
  CHECK(GrowthOf(cell).Share(Measured()) == 0);
  CHECK(GrowthOf(cell).Outside(Measured()));
  const OperatingPoint empty = With([](OperatingPoint& at) { at.payload_kg = 0; });
  CHECK(GrowthOf(cell).Share(empty) == 1);
  cell.domain->declared_sigma_m.reset();  // a confirmed cause
  CHECK(GrowthOf(cell).Share(tool) == 1);
  CHECK(GrowthOf(cell).Outside(tool));
}

TEST_CASE("a point is extrapolated once its growth exceeds what was validated") {
  const ErrorGrowth growth = GrowthOf(Fitted());
  const auto outside = [&](double tau2_Nm, double tau5_Nm) {
    return growth.Outside(With([&](OperatingPoint& at) {
      at.tau[1] = tau2_Nm;
      at.tau[4] = tau5_Nm;
    }));
  };
  CHECK_FALSE(outside(-49.9, 0));  // 50 N m add as much as residual_sigma
  CHECK(outside(-50.1, 0));
  CHECK_FALSE(outside(-35, 40));  // 0.7^2 + 0.7^2 < 1
  CHECK(outside(-36, 41));
}

TEST_CASE(
    "a value that no held-out row can have tested is extrapolated, however small the growth") {
  model::CellModel cell = Fitted();
  cell.domain->distant_sigma_m = 1e-6;
  const auto outside = [&](const std::function<void(OperatingPoint&)>& change) {
    const ErrorGrowth growth = GrowthOf(cell);
    CHECK(growth.Describes(With(change)));  // the radius is known nevertheless
    return growth.Outside(With(change));
  };
  CHECK_FALSE(outside([](OperatingPoint& at) { at.payload_kg = 41.9; }));  // 5 % of 40 kg
  CHECK(outside([](OperatingPoint& at) { at.payload_kg = 42.1; }));
  CHECK_FALSE(outside([](OperatingPoint& at) { at.temp_C = 25.2; }));
  CHECK(outside([](OperatingPoint& at) { at.temp_C = 26; }));
  CHECK(outside([](OperatingPoint& at) { at.t_s = 4000; }));
  CHECK_FALSE(outside([](OperatingPoint& at) { at.q[2] = 1.09; }));  // 5 % of 2 rad
  CHECK(outside([](OperatingPoint& at) { at.q[2] = 1.11; }));
  const auto between = [](OperatingPoint& at) { at.payload_kg = 30; };
  cell.domain->payload_kg->intervals = {{0, 0}, {40, 40}};
  CHECK(outside(between));
  cell.domain->payload_kg->intervals = {{0, 0}, {20, 20}, {40, 40}};
  CHECK_FALSE(outside(between));
}

TEST_CASE("the inputs that make a point extrapolated are named, the largest first") {
  model::CellModel cell = Fitted();
  const auto beyond = [](OperatingPoint& at) {
    at.payload_kg = 55;  // 0.15 mm
    at.temp_C = 25.2;    // a small part
    at.tau[4] = 105;     // 0.2 mm
  };
  const std::vector<DomainExit> exits = GrowthOf(cell).Exits(With(beyond));
  REQUIRE(exits.size() == 2);
  CHECK(exits[0].input == Input::kTorque);
  CHECK(exits[0].index == 4);
  CHECK(exits[0].value == 105);
  CHECK(exits[0].range == model::Interval{-20, 5});
  CHECK(exits[0].variance_m2.value() == Approx(4e-8));
  CHECK(exits[1].input == Input::kPayload);
  CHECK(exits[1].value == 55);
  // An input without a growth comes first, whatever the others add.
  cell.domain->temp_C->growth.reset();
  const std::vector<DomainExit> unknown = GrowthOf(cell).Exits(With(beyond));
  REQUIRE(unknown.size() == 3);
  CHECK(unknown[0].input == Input::kTemperature);  // without a growth
  CHECK_FALSE(unknown[0].variance_m2);
  CHECK(unknown[1].input == Input::kTorque);
  // Within what was validated there is nothing to name.
  CHECK(GrowthOf(cell).Exits(With([](OperatingPoint& at) { at.payload_kg = 41; })).empty());
}

TEST_CASE("the postures are tested by their distance, or without measured ones by the joints") {
  model::CellModel cell = Fitted();
  const OperatingPoint turned = With([](OperatingPoint& at) { at.q[2] = 1.5; });
  const std::vector<DomainExit> far = GrowthOf(cell).Exits(turned);
  REQUIRE(far.size() == 2);
  CHECK(far[0].input == Input::kPosture);
  CHECK(far[1].input == Input::kJoint);
  cell.domain->poses.clear();
  cell.domain->distant_sigma_m.reset();
  const std::vector<DomainExit> exits = GrowthOf(cell).Exits(turned);
  REQUIRE(exits.size() == 1);
  CHECK(exits[0].input == Input::kJoint);
  CHECK(exits[0].index == 2);
  CHECK(exits[0].value == 1.5);
  CHECK(exits[0].range == model::Interval{-1, 1});
  CHECK_FALSE(GrowthOf(cell).Outside(Measured()));
}

TEST_CASE("without a domain only the joint limits count") {
  const model::CellModel cell = test::HeavyArm();
  const ErrorGrowth growth = GrowthOf(cell);
  OperatingPoint point = With([](OperatingPoint& at) {
    at.payload_kg = 4000;
    at.temp_C = 500;
    at.item = 3;
  });
  CHECK_FALSE(growth.Outside(point));
  CHECK(growth.Share(point) == 1);
  CHECK(growth.Variance(point) == 0);
  point.q[4] = cell.robot.joints[4].max + 0.01;
  CHECK(growth.Outside(point));
  CHECK(growth.Exits(point).front().range.high == cell.robot.joints[4].max);
}

TEST_CASE("in a file that states no times, an effect holds while it was seen") {
  model::CellModel cell = Fitted();
  cell.effects.resize(2);
  for (model::WrittenEffect& effect : cell.effects) {
    effect.id = "thermal_drift";
    effect.parameters = {{"x", 1, std::nullopt, "mm", ""},
                         {"y", 0, std::nullopt, "mm", ""},
                         {"z", 0, std::nullopt, "mm", ""},
                         {"time_constant", 600, std::nullopt, "s", ""}};
  }
  cell.effects[0].seen_t_s = model::Interval{0, 3000};
  cell.effects[1].seen_t_s = model::Interval{500, 5000};
  const auto outside = [&](double t_s) {
    return GrowthOf(cell).Outside(With([&](OperatingPoint& at) { at.t_s = t_s; }));
  };
  CHECK_FALSE(outside(499));  // the domain's own times, with a growth
  CHECK_FALSE(outside(3001));
  cell.domain->t_s.reset();
  CHECK(outside(499));
  CHECK_FALSE(outside(500));
  CHECK_FALSE(outside(3000));
  CHECK(outside(3001));
}

TEST_CASE("a tool or payload item that was not measured is outside the domain") {
  model::CellModel cell = test::HeavyArm();
  const auto outside = [&](int tool, int item) {
    return GrowthOf(cell).Outside(With([&](OperatingPoint& at) {
      at.tool = tool;
      at.item = item;
    }));
  };
  cell.tool.number = 4;
  cell.further_tools = {cell.tool};
  cell.further_tools[0].number = 7;
  cell.payload_items = {{1, 5, Vec3::Zero()}, {2, 5, Vec3::Zero()}};
  CHECK_FALSE(outside(1, 2));  // without a domain
  CHECK((ToolCovered(cell, 1) && ItemCovered(cell, 2)));
  cell.domain.emplace();
  cell.domain->q.assign(6, model::Interval{-1, 1});
  cell.domain->payload_kg = model::MeasuredRange{{{0, 40}}, {}};
  // A domain of an older model names neither: nothing is known about the items.
  CHECK_FALSE(outside(1, 0));
  CHECK(outside(0, 1));
  cell.domain->tools = {4};
  cell.domain->payload_items = {0, 1};
  CHECK_FALSE(outside(0, 0));
  CHECK_FALSE(outside(0, 1));
  CHECK(outside(0, 2));
  CHECK(outside(1, 0));
  CHECK((ToolCovered(cell, 0) && !ToolCovered(cell, 1)));
  CHECK((ItemCovered(cell, 1) && !ItemCovered(cell, 2)));
  cell.domain->payload_items = {1};
  CHECK(outside(0, 0));
}

}  // namespace plumbline::error_growth_test
