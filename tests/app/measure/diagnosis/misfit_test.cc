// Rows that the model fits worse than the others, and directions of load that rows hardly show.
#include "app/measure/diagnosis/critics/misfit.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <random>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/linear/plausibility.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/loads/numbered_load.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::misfit_test {

using namespace plumbline::measure;

namespace {

Result<Diagnosis> Answer(const MeasuredCell& data) {
  return Diagnose(data.cell, data.table, {});
}

bool Notes(const Diagnosis& diagnosis, const std::string& text) {
  return std::any_of(diagnosis.notes.begin(), diagnosis.notes.end(),
                     [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

/// Adds normal noise to the points of the rows for which `disturbed` holds.
void Disturb(MeasuredCell& data, double sigma_m, unsigned seed,
             const std::function<bool(std::size_t)>& disturbed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, sigma_m);
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    if (disturbed(k))
      *data.table.rows[k].measured_W += Vec3(noise(random), noise(random), noise(random));
  }
}

}  // namespace

TEST_CASE("larger residuals under a rare load are its condition, and that load is not validated") {
  for (const bool by_load : {true, false}) {
    CAPTURE(by_load);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
    for (std::size_t k = 0; k < data.table.rows.size(); ++k)
      data.table.rows[k].payload_kg = k % 9 == 4 ? 8 : k % 2 == 0 ? 2 : 4;
    Remeasure(data, {}, 5e-5, 7);
    // Mostly within what rejects a row.
    Disturb(data, 2e-4, 11, [&](std::size_t k) { return k % 9 == (by_load ? 4 : 5); });
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    REQUIRE(diagnosis->misfit.has_value() == by_load);
    if (by_load) CHECK(TextOf(diagnosis->misfit->condition) == "payload_kg of 8 or more");
    REQUIRE(diagnosis->domain.payload_kg);
    CHECK(diagnosis->domain.payload_kg->Hull().high == (by_load ? 4 : 8));
    if (!by_load) continue;
    CHECK(diagnosis->verdict == Verdict::kUnknown);
    CHECK(diagnosis->drivers == std::vector<std::string>{"payload_kg"});
  }
}

TEST_CASE("larger residuals under most rows are named, but leave no domain without them") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 90 --repeats 0 --seed 5");
  for (std::size_t k = 0; k < data.table.rows.size(); ++k)
    data.table.rows[k].payload_kg = k % 9 < 5 ? 8 : k % 2 == 0 ? 2 : 4;
  Remeasure(data, {}, 5e-5, 7);
  Disturb(data, 4e-4, 12, [](std::size_t k) { return k % 9 < 5; });
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  REQUIRE(diagnosis->misfit);
  CHECK(TextOf(diagnosis->misfit->condition) == "payload_kg of 8 or more");
  REQUIRE(diagnosis->domain.payload_kg);
  CHECK(diagnosis->domain.payload_kg->Hull().high == 8);
}

TEST_CASE("a joint that yields in one direction only is explained") {
  MeasuredCell data = Simulated("--family none --seed 3 --robot ur10");
  Remeasure(data,
            {EffectWith(data.cell, "joint_compliance", {{"q3", 2e-6}}),
             EffectWith(data.cell, "compliance_asymmetry", {{"q3", -2e-6}})},
            5e-5, 3);
  const auto one_sided = Answer(data);
  REQUIRE(one_sided);
  CHECK(one_sided->verdict == Verdict::kExplained);
  REQUIRE(one_sided->findings.size() == 2);
  for (const Finding& finding : one_sided->findings) {
    REQUIRE(finding.effect.values.size() == 1);
    CHECK(finding.effect.term.parameters[0].joint == 2);
    CHECK(std::abs(finding.effect.values[0]) == Approx(2e-6).epsilon(0.1));
  }
}

TEST_CASE("larger residuals for a while are noted with their lines, and name no driver") {
  for (const bool heavy_then : {false, true}) {
    CAPTURE(heavy_then);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
    const auto then = [](std::size_t k) { return k >= 30 && k < 48; };
    for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
      data.table.rows[k].payload_kg = heavy_then && then(k) ? 8 : k % 2 == 0 ? 2 : 4;
      data.table.rows[k].temp_C = 20 + 0.1 * static_cast<double>(k % 7);
    }
    Remeasure(data, {}, 5e-5, 7);
    Disturb(data, 1.5e-4, 11, then);
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    CHECK(diagnosis->verdict == Verdict::kUnknown);  // the declared noise does not account for them
    CHECK(diagnosis->drivers.empty());
    CHECK(Notes(*diagnosis, "successive poses (lines ") != heavy_then);
    CHECK(Notes(*diagnosis, "with payload_kg of 8 or more are") == heavy_then);
    CHECK(Notes(*diagnosis, "in only one stretch of time, within lines 32 to 49") == heavy_then);
    if (!heavy_then) continue;
    REQUIRE(diagnosis->domain.payload_kg);
    CHECK(diagnosis->domain.payload_kg->Hull().high == 4);
  }
}

TEST_CASE("a disturbance that coincides with many heavy rows is not blamed on the load") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 120 --repeats 0 --seed 5");
  const auto then = [](std::size_t k) { return k >= 40 && k < 76; };
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    const bool heavy = then(k) ? k % 10 < 7 : k % 10 == 0;
    data.table.rows[k].payload_kg = heavy ? 8 : k % 2 == 0 ? 2 : 4;
  }
  Remeasure(data, {}, 5e-5, 7);
  Disturb(data, 1.5e-4, 11, then);
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->drivers.empty());
  CHECK(Notes(*diagnosis, "successive poses (lines "));
}

TEST_CASE("equal noise is no condition and no stretch") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 120 --repeats 20 --seed 5");
  const Result<Dataset> rows = DatasetFrom(data.cell, data.table);
  REQUIRE(rows);
  std::mt19937 random(3);
  std::normal_distribution<double> noise;
  constexpr int kSets = 2000;
  int conditions = 0, stretches = 0;
  for (int set = 0; set < kSets; ++set) {
    PerRow<double> sizes;
    for ([[maybe_unused]] const RowIndex row : rows->row_indices())
      sizes.push_back(Vec3(noise(random), noise(random), noise(random)).norm());
    conditions += FindLargerUnderCondition(*rows, sizes).has_value() ? 1 : 0;
    stretches += FindLargerForAWhile(*rows, sizes).has_value() ? 1 : 0;
  }
  // At most 0.1 % each: nine or more of 2,000 happen once in 4,000 times.
  CHECK(conditions < 9);
  CHECK(stretches < 9);
}

TEST_CASE("the torque of a joint counts as measured in the directions in which poses load it") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 5");
  const deflection::LoadedArm arm(data.cell);
  const auto torque_Nm = [&](const measure::MeasuredRow& row) {
    return arm.PointAt(row.q, loads::LoadOf(data.cell, row.payload_kg, {}, {}), {}).tau[2];
  };
  std::vector<measure::MeasuredRow> one_way, other_way;
  for (const measure::MeasuredRow& row : data.table.rows) {
    if (std::abs(torque_Nm(row)) > 10) (torque_Nm(row) > 0 ? one_way : other_way).push_back(row);
  }
  const bool positive = one_way.size() > other_way.size();
  if (!positive) std::swap(one_way, other_way);
  REQUIRE(other_way.size() >= 5);
  double largest_Nm = 0;
  for (const measure::MeasuredRow& row : one_way)
    largest_Nm = std::max(largest_Nm, std::abs(torque_Nm(row)));
  const effects::ActiveEffect soft = EffectWith(data.cell, "joint_compliance", {{"q3", 3e-5}});
  for (const std::size_t reversed : {0, 2, 5}) {
    CAPTURE(reversed);
    data.table.rows = one_way;
    data.table.rows.insert(data.table.rows.end(), other_way.begin(),
                           other_way.begin() + static_cast<std::ptrdiff_t>(reversed));
    Remeasure(data, {soft}, 5e-5, 7);
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    const auto& torques = diagnosis->domain.torques;
    const auto found = std::find_if(torques.begin(), torques.end(),
                                    [](const auto& torque) { return torque.joint == 2; });
    REQUIRE(found != torques.end());
    CHECK(found->range.growth.has_value() == diagnosis->domain.residual_sigma_m.has_value());
    const model::Interval range = found->range.Hull();
    CHECK(range.Contains(0));
    const double seen_Nm = positive ? range.high : -range.low;
    CHECK(seen_Nm > 0.5 * largest_Nm);
    CHECK(seen_Nm <= 1.01 * largest_Nm);
    CHECK((positive ? -range.low : range.high) < (reversed < 5 ? 1e-9 : largest_Nm));
    if (reversed == 5) CHECK((positive ? -range.low : range.high) > 5);
  }
}

TEST_CASE("without link masses, a note says that the directions of load are not known") {
  for (const bool declared : {true, false}) {
    CAPTURE(declared);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 5");
    Remeasure(data, {EffectWith(data.cell, "joint_compliance", {{"q2", 3e-5}, {"q3", 6e-5}})}, 5e-5,
              7);
    if (!declared) {
      for (model::Joint& joint : data.cell.robot.joints) joint.link_mass_kg.reset();
    }
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    CHECK_FALSE(diagnosis->findings.empty());
    CHECK(Notes(*diagnosis, "link_mass_kg is not declared for every link") != declared);
  }
}

TEST_CASE("a negative backlash by load is implausible unless it reduces a declared one") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --repeats 0 --seed 5");
  const effects::ActiveEffect gap = EffectWith(data.cell, "backlash", {{"q3", -1e-4}}, "load");
  const auto implausible = [&](const effects::ActiveEffect& effect) {
    const Result<Dataset> rows = DatasetFrom(data.cell, data.table);
    REQUIRE(rows);
    return ImplausibilityOf(*rows, effect).sentence;
  };
  CHECK_THAT(implausible(gap), Catch::Contains("joint q3 would yield against its load"));
  CHECK(implausible(EffectWith(data.cell, "backlash", {{"q3", -1e-4}}, "move")).empty());
  // Other ranges that start at zero say nothing about a load.
  CHECK_THAT(implausible(EffectWith(data.cell, "joint_compliance", {{"q3", -1e-3}})),
             !Catch::Contains("is negative"));
  data.cell.effects = {effects::WrittenFromActive(
      EffectWith(data.cell, "backlash", {{"q3", 3e-4}}, "load"), Eigen::MatrixXd())};
  CHECK(implausible(gap).empty());
}

}  // namespace plumbline::misfit_test
