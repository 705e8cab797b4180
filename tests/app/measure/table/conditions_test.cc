// Conditions of the rows of a table, with coupled axes.
#include "app/measure/table/conditions.h"

#include <catch2/catch.hpp>

#include "firmware-like/deflection/loaded_arm.h"
#include "tests/firmware-like/effects/any_term.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::conditions_test {
namespace {

model::CellModel CellWith(const effects::EffectTerm& term, const std::vector<double>& values) {
  model::CellModel cell = test::HeavyArm();
  cell.measurement.reference_temperature_C = 20;
  cell.effects = {effects::WrittenFromActive({term, values, {}}, {})};
  return cell;
}

/// Rows of one session that differ in everything; joint values as reported.
measure::MeasuredTable AnyTable(std::mt19937& random) {
  std::uniform_real_distribution<double> draw(-1, 1);
  const auto joints = [&](double size) {
    model::JointVector values(6);
    for (double& value : values) value = size * draw(random);
    return values;
  };
  measure::MeasuredTable table;
  table.further = {"tilt_x_deg", "tilt_y_deg"};
  for (int k = 0; k < 6; ++k) {
    measure::MeasuredRow& row = table.rows.emplace_back();
    row.line = k + 2;
    row.q = joints(1);
    // A move of the second joint alone also moves the third axis.
    if (k % 2 == 1) {
      row.q = table.rows[static_cast<std::size_t>(k - 1)].q;
      row.q[1] += 0.3 * draw(random);
    }
    row.qd = joints(1);
    row.qdd = joints(5);
    row.payload_kg = 50;
    row.t_s = 300.0 * k;
    row.temp_C = 25 + k;
    row.further = {draw(random), draw(random)};
  }
  return table;
}

}  // namespace

TEST_CASE("with every effect, an arm with couplings at q is the uncoupled arm at C q") {
  std::mt19937 random(31);
  const std::vector<model::JointCoupling> couplings = {{2, 1, 1.0}, {3, 1, 0.7}, {1, 0, -0.4}};
  int acted = 0;
  for (const effects::Effect* effect : effects::Catalogue()) {
    for (const effects::EffectTerm& term : effects::AnyTerms(*effect)) {
      CAPTURE(effect->traits().id, term.word);
      const model::CellModel uncoupled = CellWith(term, effects::AnyValues(term, random));
      model::CellModel coupled = uncoupled;
      coupled.robot.couplings = couplings;
      const measure::MeasuredTable reported = AnyTable(random);
      measure::MeasuredTable axes = reported;
      for (measure::MeasuredRow& row : axes.rows) {
        for (model::JointVector* values : {&row.q, &row.qd, &row.qdd}) {
          *values = model::AxisPositions<double>(couplings, *values);
        }
      }
      const auto moments = measure::ConditionsOf(coupled, reported);
      const auto expected_moments = measure::ConditionsOf(uncoupled, axes);
      const deflection::LoadedArm arm(coupled), expected_arm(uncoupled);
      const loads::Payload payload{50, *coupled.payload_cog_F};
      for (std::size_t k = 0; k < moments.size(); ++k) {
        const effects::Conditions& moment = moments[k];
        CHECK((moment.Reported(moment.qd) - reported.rows[k].qd).norm() < 1e-14);
        CHECK(moment.Signal("q3_deg").value_or(0) ==
              Approx(reported.rows[k].q[2] / test::kDegree).margin(1e-9));
        const auto influence = arm.EffectsAt(moment, payload);
        const auto expected = expected_arm.EffectsAt(expected_moments[k], payload);
        for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
          CHECK(influence[entry] == Approx(expected[entry]).margin(1e-12));
          if (expected[entry] != 0) ++acted;
        }
        deflection::LoadedState state, expected_state;
        const bool settled = arm.AtCommanded(reported.rows[k].q, payload, moment, state);
        REQUIRE(settled == expected_arm.AtCommanded(axes.rows[k].q, payload, expected_moments[k],
                                                    expected_state));
        if (settled) CHECK((state.X_WT.p - expected_state.X_WT.p).norm() < 1e-9);
      }
    }
  }
  CHECK(acted > 500);
}

}  // namespace plumbline::conditions_test
