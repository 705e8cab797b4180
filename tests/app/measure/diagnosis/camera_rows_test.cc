// Rows measured by two cameras: own pose and scale of each, and the error of the reference tags
// that they share. The errors are added here to the simulator's points, without the model's
// formulas.
#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/linear/refit.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::camera_rows_test {

using namespace plumbline::measure;

namespace {

constexpr double kScale = 1.003;

/// Two cameras measure the poses in turn.
void ByTwoCameras(MeasuredCell& data) {
  data.table.recorded.camera = true;
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    data.table.rows[k].camera = k % 2 == 0 ? "side" : "rear";
  }
}

/// The rear camera is not where it was declared, and its focal length is wrong: its points are
/// rotated and enlarged about its own place.
void DisturbRear(MeasuredCell& data) {
  const Vec3 camera(2.5, -1.5, 1.8);
  const Eigen::AngleAxisd turn(0.002, Vec3(1, 2, -1).normalized());
  for (measure::MeasuredRow& row : data.table.rows) {
    if (row.camera != "rear") continue;
    row.measured_W =
        camera + Vec3(0.0012, -0.0008, 0.0005) + kScale * (turn * Vec3(*row.measured_W - camera));
  }
}

std::vector<std::string> Named(const Diagnosis& diagnosis) {
  std::vector<std::string> names;
  for (const Finding& finding : diagnosis.findings) {
    names.push_back(std::string(finding.effect.term.effect->traits().id) + " " +
                    std::string(finding.effect.term.word));
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Four tags on a square of 1 m, whose frame is then known to 0.1 mm and 0.2 mrad or less.
void DeclareTags(MeasuredCell& data) {
  data.cell.measurement.reference_tags_W = {Vec3(0.5, 0.5, 0), Vec3(-0.5, 0.5, 0),
                                            Vec3(-0.5, -0.5, 0.1), Vec3(0.5, -0.5, 0)};
  data.cell.measurement.reference_sd_m = 2e-4;
}

Dataset DatasetOf(const MeasuredCell& data) {
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  if (!dataset) FAIL(dataset.error());
  return std::move(dataset).value();
}

/// Standard deviation of a shift of the base along x [m], from this many rows.
double ShiftDeviation(int rows, bool tags) {
  MeasuredCell data =
      Simulated("--family none --seed 5 --repeats 0 --rows " + std::to_string(rows));
  ByTwoCameras(data);
  if (tags) DeclareTags(data);
  const Dataset dataset = DatasetOf(data);
  Model start = Model::Declared(dataset);
  start.effects = {EffectWith(data.cell, "base_frame", {{"x", 1e-6}})};
  const Result<Refit> refit = RefitModel(UnitWeightFit(dataset, 1), start, {});
  REQUIRE(refit);
  return std::sqrt(refit->covariance(0, 0));
}

}  // namespace

TEST_CASE("the pose and scale of one camera are separated from an effect of the arm") {
  for (const int seed : {3, 4}) {
    CAPTURE(seed);
    MeasuredCell data = Simulated("--family joint_compliance@q2,q3 --signal 20 --rows 60 --seed " +
                                  std::to_string(seed));
    ByTwoCameras(data);
    DisturbRear(data);
    const auto answer = Diagnose(data.cell, data.table, {});
    REQUIRE(answer);
    CHECK(Named(*answer) == std::vector<std::string>{"camera_frame rear", "joint_compliance "});
    CHECK(answer->verdict == Verdict::kExplained);
    CHECK(answer->rms_after_m < 1.3 * answer->noise_floor_m);
    for (const Finding& finding : answer->findings) {
      const effects::EffectTerm& term = finding.effect.term;
      for (std::size_t k = 0; k < term.parameters.size(); ++k) {
        const auto spec = static_cast<std::size_t>(term.parameters[k].spec);
        if (term.effect->traits().parameters[spec].name != "scale") continue;
        CHECK(finding.effect.values[k] == Approx(kScale - 1).epsilon(0.05));
      }
    }
    // Without the names of the cameras the difference is taken for something else.
    for (measure::MeasuredRow& row : data.table.rows) row.camera.clear();
    const auto unnamed = Diagnose(data.cell, data.table, {});
    REQUIRE(unnamed);
    const bool right = unnamed->verdict == Verdict::kExplained &&
                       Named(*unnamed) == std::vector<std::string>{"joint_compliance "};
    CHECK_FALSE(right);
  }
}

TEST_CASE("a displacement that both cameras measure is of the base, not of the cameras") {
  MeasuredCell data = Simulated("--family base_frame --signal 20 --rows 60 --seed 7");
  ByTwoCameras(data);
  const auto answer = Diagnose(data.cell, data.table, {});
  REQUIRE(answer);
  CHECK(Named(*answer) == std::vector<std::string>{"base_frame "});
}

TEST_CASE("an error of the reference tags that they may have is no effect of the arm") {
  MeasuredCell data = Simulated("--family none --rows 60 --seed 8");
  ByTwoCameras(data);
  for (measure::MeasuredRow& row : data.table.rows) *row.measured_W += Vec3(1.5e-4, -1e-4, 1e-4);
  const auto exact = Diagnose(data.cell, data.table, {});
  REQUIRE(exact);
  CHECK_FALSE(exact->findings.empty());
  DeclareTags(data);
  const auto uncertain = Diagnose(data.cell, data.table, {});
  REQUIRE(uncertain);
  CHECK(Named(*uncertain).empty());
  CHECK(uncertain->verdict == Verdict::kNoEffect);
}

TEST_CASE("rejected rows that are those of one camera are not called no effect") {
  MeasuredCell data = Simulated("--family none --rows 56 --seed 7");
  ByTwoCameras(data);
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    measure::MeasuredRow& row = data.table.rows[k];
    const bool rear = k % 11 == 0;
    row.camera = rear ? "rear" : "side";
    if (rear) row.measured_W->x() += 3e-3;
  }
  const auto answer = Diagnose(data.cell, data.table, {});
  REQUIRE(answer);
  CHECK(answer->verdict != Verdict::kNoEffect);
  const bool found = std::count(answer->drivers.begin(), answer->drivers.end(), "camera") > 0 ||
                     !Named(*answer).empty();
  CHECK(found);
}

TEST_CASE("more rows do not reduce the error of the reference tags") {
  const double few = ShiftDeviation(40, false), many = ShiftDeviation(160, false);
  CHECK(many < 0.6 * few);
  const double few_on_tags = ShiftDeviation(40, true), many_on_tags = ShiftDeviation(160, true);
  CHECK(few_on_tags > 0.95e-4);  // 0.2 mm, averaged over four tags
  CHECK(many_on_tags > 0.95e-4);
  CHECK(many_on_tags > 0.9 * few_on_tags);
}

TEST_CASE("the derivatives of rows on reference tags equal finite differences") {
  MeasuredCell data = Simulated("--family none --rows 20 --repeats 0 --seed 5");
  ByTwoCameras(data);
  DeclareTags(data);
  for (std::size_t k = 0; k < data.table.rows.size(); k += 3) data.table.rows[k].camera.clear();
  const Dataset dataset = DatasetOf(data);
  const Nuisances nuisances(dataset);
  REQUIRE(nuisances.size() == 6);
  REQUIRE(nuisances.equations() == 6);
  const Model model = Model::Declared(dataset);
  const Result<Linearisation> at = Linearise(dataset, model, false, 1);
  REQUIRE(at);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < nuisances.size(); ++k) {
    Model moved = model;
    nuisances.Move(kStep * Eigen::VectorXd::Unit(nuisances.size(), k), moved);
    const Result<Linearisation> after = Linearise(dataset, moved, false, 1);
    REQUIRE(after);
    for (const RowIndex row : dataset.row_indices()) {
      Eigen::MatrixXd X = Eigen::MatrixXd::Zero(3, nuisances.size());
      nuisances.Fill(at->rows[row], row, X);
      const Eigen::VectorXd slope = (at->rows[row].residual - after->rows[row].residual) / kStep;
      CHECK((X.col(k) - slope).norm() < 1e-9);
      CHECK((X.col(k).norm() > 0) == !dataset.measured(row).camera.empty());
    }
    const std::vector<Equation> here = nuisances.EquationsAt(model);
    const std::vector<Equation> there = nuisances.EquationsAt(moved);
    for (std::size_t e = 0; e < here.size(); ++e) {
      double declared = 0;
      for (const auto& [nuisance, value] : here[e].slopes) declared += nuisance == k ? value : 0;
      CHECK((here[e].residual - there[e].residual) / kStep == Approx(declared).margin(1e-6));
    }
  }
}

}  // namespace plumbline::camera_rows_test
