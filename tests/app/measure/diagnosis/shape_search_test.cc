// Shape searches: proposal from a residual, conversion to effects, and exclusion.
#include "app/measure/diagnosis/linear/shape_search.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"
#include "firmware-like/effects/catalogue.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::shape_search_test {

using namespace plumbline::measure;

namespace {

/// Simulated rows of an arm with one effect and a little noise.
struct Rows {
  MeasuredCell measured;
  Result<Dataset> data;
  std::shared_ptr<const Linearisation> linear;
  std::optional<LinearProblem> problem;

  Rows(const std::string& id, const std::vector<std::pair<std::string, double>>& values,
       const std::string& word = "")
      : measured(Simulated("--family none --robot ur10 --rows 80 --repeats 0 --seed 3")),
        data(WithEffect(id, values, word)) {
    REQUIRE(data);
    const Model declared = Model::Declared(*data);
    linear = std::make_shared<const Linearisation>(*Linearise(*data, declared, true, 1));
    FitProblem fit = UnitWeightFit(*data, 1);
    fit.sigma_m = 2e-5;
    problem.emplace(std::move(fit), linear, declared);
  }

  Result<Dataset> WithEffect(const std::string& id,
                             const std::vector<std::pair<std::string, double>>& values,
                             const std::string& word) {
    Remeasure(measured, {EffectWith(measured.cell, id, values, word)}, 2e-5, 11);
    return DatasetFrom(measured.cell, measured.table);
  }

  std::vector<Block> Proposed(const std::string& id) const {
    return ShapeSearchOf(*effects::FindEffect(id))->Propose(*problem, problem->response());
  }
};

double ValueOf(const effects::ActiveEffect& effect, std::string_view parameter) {
  for (std::size_t k = 0; k < effect.values.size(); ++k) {
    const auto spec = static_cast<std::size_t>(effect.term.parameters[k].spec);
    if (effect.term.effect->traits().parameters[spec].name == parameter) return effect.values[k];
  }
  FAIL("no parameter " << parameter);
  return 0;
}

}  // namespace

TEST_CASE("exactly the effects with a shape, or that rows may hide, have a shape search") {
  for (const effects::Effect* effect : effects::Catalogue()) {
    CAPTURE(effect->traits().id);
    const auto& specs = effect->traits().parameters;
    const bool shaped =
        std::any_of(specs.begin(), specs.end(), [](const effects::ParameterSpec& spec) {
          return spec.role == effects::ParameterRole::kShape;
        });
    const bool hidden = effect->traits().id == "compliance_asymmetry";  // torques of one direction
    CHECK((ShapeSearchOf(*effect) != nullptr) == (shaped || hidden));
  }
}

TEST_CASE("sums over unequally spaced angles equal the sums of their terms") {
  constexpr double kFirst = 0.5, kStep = 0.37;
  constexpr int kSteps = 900;
  const Eigen::VectorXd q = Eigen::VectorXd::Random(70) * 3.1;
  const Eigen::VectorXd weights = Eigen::VectorXd::Random(70);
  const Eigen::ArrayX2d sums = LineSums(q, kFirst, kStep, kSteps).Of(weights);
  REQUIRE(sums.rows() == kSteps);
  for (const int k : {0, 1, 449, 450, 451, kSteps - 1}) {
    const Eigen::ArrayXd angle = (kFirst + k * kStep) * q.array();
    CHECK(sums(k, 0) == Approx((weights.array() * angle.sin()).sum()).margin(1e-9));
    CHECK(sums(k, 1) == Approx((weights.array() * angle.cos()).sum()).margin(1e-9));
  }
}

TEST_CASE("products of carried columns equal those of the projected columns") {
  for (const char* const artefacts : {"", " --artefacts sockets --places 5 --tool-unknown"}) {
    CAPTURE(artefacts);
    const MeasuredCell measured = Simulated(
        std::string("--family none --robot ur10 --rows 80 --repeats 0 --seed 3") + artefacts);
    const Result<Dataset> data = DatasetFrom(measured.cell, measured.table);
    REQUIRE(data);
    const Model declared = Model::Declared(*data);
    FitProblem fit = UnitWeightFit(*data, 1);
    fit.sigma_m = 2e-5;
    const LinearProblem problem(
        std::move(fit), std::make_shared<const Linearisation>(*Linearise(*data, declared, true, 1)),
        declared);
    const std::vector<int> entries = {1, 2};
    const CarriedColumns& carried = problem.CarriedBy(entries);
    const int rows = problem.rows().count();
    REQUIRE(carried.rows().size() == problem.rows().size());
    const Eigen::MatrixXd factors = Eigen::MatrixXd::Random(rows, 3);
    Eigen::MatrixXd in_order(rows, 3);
    for (int k = 0; k < rows; ++k) {
      in_order.row(k) = factors.row(carried.rows()[static_cast<std::size_t>(k)].value());
    }
    Eigen::MatrixXd columns = problem.Carried(entries, factors);
    problem.Project(columns);
    const Eigen::MatrixXd gram = columns.transpose() * columns;
    CHECK((carried.Gram(in_order) - gram).norm() < 1e-9 * gram.norm());
    const Eigen::VectorXd moments = columns.transpose() * problem.response();
    CHECK((CarriedColumns::Moments(in_order, carried.Along(problem.response())) - moments).norm() <
          1e-9 * moments.norm());
  }
}

TEST_CASE("columns of a searched shape equal the derivatives of its effect") {
  const Rows rows("thermal_drift", {{"x", 5e-4}, {"time_constant", 900}});
  for (const char* const id :
       {"gear_periodic", "thermal_drift", "step_event", "tilt_event", "offset_event"}) {
    CAPTURE(id);
    for (const Block& block : rows.Proposed(id)) {
      const Eigen::MatrixXd columns = rows.problem->Columns(block, false);
      for (const FitRowIndex j : rows.problem->rows().indices()) {
        const RowIndex row = rows.problem->rows()[j];
        Eigen::MatrixXd of_effect(rows.problem->layout().count(j), block.columns.count());
        ColumnsAt(*rows.data, *rows.linear, block, row, of_effect);
        of_effect /= rows.problem->sigma_m();
        const auto of_row = rows.problem->layout().PartOf(columns, j);
        CHECK((of_row - of_effect).norm() <= 1e-9 * (1 + of_effect.norm()));
      }
    }
  }
}

TEST_CASE("an event time is found between the rows where the base moved") {
  const Rows rows("step_event", {{"time", 2500}, {"x", 3e-4}, {"z", -3e-4}}, "base");
  const std::vector<Block> blocks = rows.Proposed("step_event");
  REQUIRE(blocks.size() == 2);  // base and tool
  double before = 0, after = 1e9;
  for (const effects::Conditions& moment : rows.data->conditions) {
    (*moment.t_s < 2500 ? before : after) =
        *moment.t_s < 2500 ? std::max(before, *moment.t_s) : std::min(after, *moment.t_s);
  }
  const double found = blocks.front().columns.front().values.front();
  CHECK(found > before);
  CHECK(found < after);
  const effects::ActiveEffect effect =
      ShapeSearchOf(*blocks.front().term.effect)
          ->EffectFrom(blocks.front(), {{BlockColumnIndex(0), 1e-4}});
  CHECK(ValueOf(effect, "time") == found);
  CHECK(ValueOf(effect, "x") == 1e-4);
  CHECK(effect.values.size() == 2);  // y and z were not kept
}

TEST_CASE("a line at non-integer cycles is found with its phase") {
  const Rows rows("gear_periodic", {{"q3_amplitude", 3e-4}, {"q3_cycles", 7.3}, {"q3_phase", 0.4}});
  const ShapeSearch& search = *ShapeSearchOf(*effects::FindEffect("gear_periodic"));
  const std::vector<Block> blocks = rows.Proposed("gear_periodic");
  const auto line = std::find_if(blocks.begin(), blocks.end(), [](const Block& block) {
    return std::abs(LineOf(block)->cycles_per_turn - 7.3) < 0.2;
  });
  REQUIRE(line != blocks.end());
  CHECK(LineOf(*line)->joint == 2);
  constexpr BlockColumnIndex kSine(0), kCosine(1);
  effects::ActiveEffect effect = search.EffectFrom(*line, {{kSine, 3e-4}, {kCosine, 4e-4}});
  CHECK(ValueOf(effect, "q#_amplitude") == Approx(5e-4));
  CHECK(ValueOf(effect, "q#_phase") == Approx(std::atan2(4.0, 3.0)));
  search.Join(search.EffectFrom(*line, {{kCosine, 1e-4}}), effect);
  CHECK(ValueOf(effect, "q#_#_amplitude") == Approx(1e-4));
  CHECK(effect.term.parameters.back().harmonic == 2);
}

TEST_CASE("lines have aliases only if the readings of their joint are equally spaced") {
  Rows rows("gear_periodic", {{"q1_amplitude", 3e-4}, {"q1_cycles", 1}, {"q1_phase", 0.4}});
  const PeriodicLine line{0, 1, 0, 3e-4};
  CHECK(AliasedCycles(*rows.problem, line).empty());
  constexpr int kPerTurn = 24;
  constexpr double kGrid_rad = 2 * std::numbers::pi / kPerTurn;
  for (measure::MeasuredRow& row : rows.measured.table.rows) {
    row.q[0] = kGrid_rad * std::round(row.q[0] / kGrid_rad);
  }
  const Result<Dataset> data = DatasetFrom(rows.measured.cell, rows.measured.table);
  REQUIRE(data);
  const Model declared = Model::Declared(*data);
  const LinearProblem problem(
      UnitWeightFit(*data, 1),
      std::make_shared<const Linearisation>(*Linearise(*data, declared, true, 1)), declared);
  const std::vector<double> cycles = AliasedCycles(problem, line);
  REQUIRE(cycles.size() >= 4);
  const double expected[] = {23, 25, 47, 49};
  for (std::size_t k = 0; k < 4; ++k) CHECK(cycles[k] == Approx(expected[k]).margin(0.1));
  CHECK(AliasedCycles(problem, {1, 1, 0, 3e-4}).empty());  // q2 is not on a grid
}

TEST_CASE("two time constants, or two events with few rows between them, are excluded") {
  const Rows rows("thermal_drift", {{"x", 5e-4}, {"time_constant", 900}});
  const std::vector<Block> drifts = rows.Proposed("thermal_drift");
  const std::vector<Block> steps = rows.Proposed("step_event");
  REQUIRE(drifts.size() == 2);
  REQUIRE(steps.size() == 2);
  const auto clash = [&](const Block& a, const Block& b) {
    return ShapesConflict(*rows.problem, std::vector<const Block*>{&a, &b});
  };
  CHECK(clash(drifts[0], drifts[1]));
  CHECK_FALSE(clash(drifts[0], steps[0]));
  CHECK(clash(steps[0], steps[0]));
  Block late = steps[0];
  Block early = steps[0];
  for (BlockColumn& column : early.columns) column.values.front() = 1000;
  for (BlockColumn& column : late.columns) column.values.front() = 4000;
  CHECK_FALSE(clash(early, late));
}

TEST_CASE("the shapes of refitted effects become candidates unchanged") {
  const Rows rows("thermal_drift", {{"x", 5e-4}, {"time_constant", 900}});
  const model::CellModel& cell = rows.measured.cell;
  const std::vector<Block> blocks = BlocksOf(
      *rows.data, {EffectWith(cell, "thermal_drift", {{"y", 1e-4}, {"time_constant", 700}}),
                   EffectWith(cell, "joint_offset", {{"q1", 1e-4}}),
                   EffectWith(cell, "step_event", {{"time", 1234}, {"x", 1e-4}}, "tool")});
  REQUIRE(blocks.size() == 2);
  CHECK(blocks[0].columns.front().values.back() == 700);
  CHECK(blocks[1].columns.front().values.front() == 1234);
  CHECK(blocks[1].term.word == "tool");
}

TEST_CASE("a drift is visible only if the rows show that it changes with time") {
  const Rows rows("thermal_drift", {{"x", 1e-3}, {"time_constant", 2000}});
  const auto visible = [&](double x_m, double time_constant_s) {
    return ShapesAreVisible(*rows.problem,
                            {EffectWith(rows.measured.cell, "thermal_drift",
                                        {{"x", x_m}, {"time_constant", time_constant_s}})});
  };
  CHECK(visible(1e-3, 2000));
  CHECK_FALSE(visible(1e-3, 10));    // over before the first row
  CHECK_FALSE(visible(1e-6, 2000));  // below the noise
}

}  // namespace plumbline::shape_search_test
