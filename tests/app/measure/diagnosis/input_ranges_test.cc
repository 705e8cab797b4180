// Measured ranges of the inputs beside the joints, and distances beyond them.
#include "app/measure/diagnosis/validation/input_ranges.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace plumbline::input_ranges_test {

using namespace plumbline::measure;

namespace {

/// Inputs of rows, and the ranges that all of them show.
struct Rows {
  InputsOfRows inputs;
  std::vector<double> levers{};

  RowInputs& Add(double tau1_Nm, double tau2_Nm) {
    RowInputs row;
    row.tau.resize(2);
    row.tau << tau1_Nm, tau2_Nm;
    return inputs.rows.emplace_back(row);
  }
  InputRanges Ranges() const {
    FitRows all;
    for (const RowIndex row : inputs.rows.indices()) all.push_back(row);
    InputsOfRows with_units = inputs;
    with_units.units = UnitsOf(inputs.rows, all, levers);
    return InputRanges(with_units, all);
  }
};

/// Rows without torques, each with one value of an input.
InputRanges RangesOf(std::optional<double> RowInputs::*input, const std::vector<double>& values) {
  Rows rows;
  for (const double value : values) rows.Add(0, 0).*input = value;
  return rows.Ranges();
}

double Beyond(const InputRanges& ranges, ModelInput input, const RowInputs& row) {
  return ranges.Beyond(row)[static_cast<int>(input)];
}

double BeyondPayload(const InputRanges& ranges, double payload_kg) {
  RowInputs row;
  row.payload_kg = payload_kg;
  return Beyond(ranges, ModelInput::kPayload, row);
}

model::Domain Stated(const InputRanges& ranges,
                     const std::optional<InputRanges::Growth>& growth = InputRanges::Growth{
                         BeyondRanges::Ones(), 0, true}) {
  model::Domain domain;
  ranges.StateIn(domain, growth);
  return domain;
}

double Squared(double value) {
  return value * value;
}

}  // namespace

TEST_CASE("a joint is beyond its range by its lever") {
  Rows rows;
  for (const double q : {-1.0, 0.0, 3.0}) {
    rows.Add(0, 0).q.resize(2);
    rows.inputs.rows[RowIndex(rows.inputs.rows.count() - 1)].q << q, 0.1 * q;
  }
  FitRows all;
  for (const RowIndex row : rows.inputs.rows.indices()) all.push_back(row);
  InputsOfRows inputs = rows.inputs;
  inputs.units = UnitsOf(inputs.rows, all, {});
  inputs.units.per_rad = {0.5, 1};
  inputs.units.turns = {true, false};
  RowInputs at;
  at.q.resize(2);
  at.q << 4, -0.2;
  CHECK(Beyond(InputRanges(inputs, all), ModelInput::kRange, at) ==
        Approx(Squared(0.5 * 1) + Squared(0.1)));
  at.q[0] = -1.5 + 2 * std::numbers::pi;  // 1.78 rad beyond, but half a radian within a whole turn
  CHECK(Beyond(InputRanges(inputs, all), ModelInput::kRange, at) ==
        Approx(Squared(0.5 * 0.5) + Squared(0.1)));
}

TEST_CASE("loads that are far apart are single values, with gaps between them") {
  const InputRanges apart = RangesOf(&RowInputs::payload_kg, {20, 0, 5, 5.1, 0, 20});
  CHECK(Stated(apart).payload_kg->intervals ==
        std::vector<model::Interval>{{0, 0}, {5, 5.1}, {20, 20}});
  CHECK(BeyondPayload(apart, 5.05) == 0);
  CHECK(BeyondPayload(apart, 12) == Approx(Squared(6.9 / 10)));  // from 5.1 kg, in mean gaps
  CHECK(BeyondPayload(apart, 15) == Approx(Squared(5.0 / 10)));  // from 20 kg
  std::vector<double> many;
  for (int k = 0; k <= 20; ++k) many.push_back(0.5 * k);
  const InputRanges dense = RangesOf(&RowInputs::payload_kg, many);
  CHECK(Stated(dense).payload_kg->intervals == std::vector<model::Interval>{{0, 10}});
  // The unit includes 0 kg, so that one load shows how small a difference is.
  const InputRanges one = RangesOf(&RowInputs::payload_kg, {12, 12});
  CHECK(BeyondPayload(one, 9) == Approx(Squared(3.0 / 12)));
}

TEST_CASE("the range of a torque includes zero and leaves out the two extremes on each side") {
  Rows rows;
  rows.levers = {1, 1};
  for (const double tau_Nm : {50.0, 3.0, -9.0, 1.0, 60.0, 2.0, -8.0}) rows.Add(tau_Nm, -tau_Nm);
  const model::Domain domain = Stated(rows.Ranges());
  REQUIRE(domain.torques.size() == 2);
  CHECK(domain.torques[0].joint == 0);
  CHECK(domain.torques[0].range.Hull() == model::Interval{0, 3});
  CHECK(domain.torques[1].range.Hull() == model::Interval{-3, 0});
}

TEST_CASE("visits of one pose show one torque") {
  Rows rows;
  rows.levers = {1, 0};
  for (int k = 0; k < 12; ++k) {
    RowInputs& row = rows.Add(k < 5 ? 90 : k, 0);
    if (k < 5) row.pose = ClusterIndex(0);
  }
  CHECK(Stated(rows.Ranges()).torques[0].range.Hull() == model::Interval{0, 10});
}

TEST_CASE("how a joint yields in a direction that no row shows may be wrong as a whole") {
  Rows rows;
  rows.levers = {1, 1};
  rows.inputs.yield = {1e-5, 0};
  for (int k = 0; k < 9; ++k) rows.Add(10 * k, k % 2 == 0 ? 50 : -50);
  BeyondRanges small = BeyondRanges::Constant(1e-6);
  const auto growths = [&](double untested_m) {
    const model::Domain domain =
        Stated(rows.Ranges(), InputRanges::Growth{small, untested_m, false});
    return std::pair(*domain.torques[0].range.growth, *domain.torques[1].range.growth);
  };
  CHECK(growths(0).first == Approx(1e-5));            // its own deflection
  CHECK(growths(1e-2).first == Approx(1e-2 / 60));    // its range: 0 to 60 N m
  CHECK(growths(1e-2).second == Approx(1e-6 / 100));  // loaded in both
}

TEST_CASE("torques count in ranges of their joint, by its lever") {
  Rows rows;
  rows.levers = {0.6, 0.8};
  for (int k = 0; k < 9; ++k) {
    const bool high = k % 3 == 0;  // three rows: one more than is left out
    rows.Add(high ? 100 : 0, high ? 2 : 0);
  }
  const InputRanges ranges = rows.Ranges();
  const auto beyond = [&](double tau1_Nm, double tau2_Nm) {
    return Beyond(ranges, ModelInput::kTorque, Rows().Add(tau1_Nm, tau2_Nm));
  };
  CHECK(beyond(100, 2) == 0);
  CHECK(beyond(150, 0) == Approx(Squared(0.6 * 50 / 100)));
  CHECK(beyond(-50, 0) == Approx(Squared(0.6 * 50 / 100)));
  CHECK(beyond(0, 7) == Approx(Squared(0.8 * 5 / 10)));  // a tenth of the largest range
  CHECK(beyond(150, 7) == Approx(beyond(150, 0) + beyond(0, 7)));
  // A torque that is not known is not stated.
  rows.levers = {0.6, 0};
  const model::Domain domain = Stated(rows.Ranges());
  REQUIRE(domain.torques.size() == 1);
  CHECK(domain.torques[0].joint == 0);
}

TEST_CASE("temperatures count in ranges of at least 5 K, times in time spans, without gaps") {
  RowInputs at;
  at.temp_C = 27;
  at.t_s = 1500;
  const InputRanges steady = RangesOf(&RowInputs::temp_C, {20, 22});
  CHECK(Stated(steady).temp_C->intervals == std::vector<model::Interval>{{20, 22}});
  CHECK(Beyond(steady, ModelInput::kTemperature, at) == Approx(1));
  const InputRanges warm = RangesOf(&RowInputs::temp_C, {15, 25});
  CHECK(Beyond(warm, ModelInput::kTemperature, at) == Approx(Squared(2.0 / 10)));
  const InputRanges times = RangesOf(&RowInputs::t_s, {0, 1000, 10});
  CHECK(Stated(times).t_s->intervals == std::vector<model::Interval>{{0, 1000}});
  CHECK(Beyond(times, ModelInput::kTime, at) == Approx(Squared(0.5)));
}

TEST_CASE("what a row did not record is not beyond, and what none recorded is not stated") {
  const InputRanges payloads = RangesOf(&RowInputs::payload_kg, {0, 5});
  CHECK((payloads.Beyond(RowInputs()) == 0).all());
  const model::Domain domain = Stated(payloads);
  CHECK_FALSE(domain.temp_C);
  CHECK_FALSE(domain.t_s);
  CHECK(domain.torques.empty());
  CHECK_FALSE(Stated(RangesOf(&RowInputs::temp_C, {20, 22})).payload_kg);
}

TEST_CASE("the stated growths are those per range, in the unit of each input") {
  Rows rows;
  rows.levers = {0.6, 0.8};
  for (int k = 0; k < 9; ++k) {
    RowInputs& row = rows.Add(k % 3 == 0 ? 100 : 0, k % 3 == 0 ? -20 : 0);
    row.payload_kg = k < 5 ? 0 : 20;
    row.temp_C = 20 + k;
    row.t_s = 100 * k;
  }
  const InputRanges ranges = rows.Ranges();
  BeyondRanges growth_m;
  growth_m << 5e-4, 1e-4, 2e-4, 3e-4, 4e-4;
  const model::Domain domain = Stated(ranges, InputRanges::Growth{growth_m, 0, true});
  RowInputs beyond = Rows().Add(-30, 10);
  beyond.payload_kg = 8;
  beyond.temp_C = 31;
  beyond.t_s = 2000;
  // The same variance from the ranges and from the domain.
  const auto gained_m2 = [](const model::MeasuredRange& measured, double value) {
    return Squared(measured.growth.value() * measured.Nearest(value).DistanceOf(value));
  };
  double sum_m2 = gained_m2(*domain.payload_kg, *beyond.payload_kg) +
                  gained_m2(*domain.temp_C, *beyond.temp_C) + gained_m2(*domain.t_s, *beyond.t_s);
  REQUIRE(domain.torques.size() == 2);
  for (const model::MeasuredTorque& torque : domain.torques)
    sum_m2 += gained_m2(torque.range, beyond.tau[torque.joint]);
  CHECK(sum_m2 == Approx((growth_m.square() * ranges.Beyond(beyond)).sum()));
  CHECK(*domain.payload_kg->growth == Approx(2e-4 / 20));
  CHECK(*domain.temp_C->growth == Approx(3e-4 / 8));
  CHECK(*domain.t_s->growth == Approx(4e-4 / 800));

  CHECK_FALSE(Stated(ranges, InputRanges::Growth{growth_m, 0, false})
                  .t_s);  // nothing in the answer follows time
  const model::Domain unknown = Stated(ranges, std::nullopt);
  CHECK_FALSE(unknown.payload_kg->growth);
  CHECK_FALSE(unknown.temp_C->growth);
  REQUIRE(unknown.torques.size() == 2);  // all that the rows had, as a limit
  CHECK(unknown.torques[0].range.Hull().high == Approx(102));
  CHECK_FALSE(unknown.torques[0].range.growth);
}

}  // namespace plumbline::input_ranges_test
