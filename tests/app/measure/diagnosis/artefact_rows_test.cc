// Rows on artefacts: kinds, residuals and their derivatives, places, and what they cannot
// determine.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <set>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::artefact_rows_test {

using namespace plumbline::measure;

namespace {

/// Simulated positions, of which every second row is turned into a row on an artefact in turn.
MeasuredCell WithEveryKind() {
  MeasuredCell data = Simulated("--family none --rows 40 --repeats 0 --seed 5 --unaligned");
  using Kind = model::ArtefactKind;
  data.cell.artefacts = {{"ball", Kind::kPoint, {}, {}, {}, 0, true},
                         {"dome", Kind::kSphere, {}, {}, {}, 0, false},
                         {"table", Kind::kPlane, {}, {}, {}, 0, true},
                         {"dial", Kind::kGauge, {}, {}, {}, 0, false},
                         {"drum", Kind::kPoint, Vec3(1, 2, 0.5), {}, {}, 1e-3, true}};
  data.cell.distances = {{0, 4, 1.5, 1e-4}};
  data.table.recorded.artefact = data.table.recorded.gauge = data.table.recorded.range = true;
  const char* names[] = {"ball", "dome", "table", "dial", "drum"};
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    measure::MeasuredRow& row = data.table.rows[k];
    if (k % 2 == 0) continue;
    row.artefact = names[(k / 2) % 5];
    row.measured_W.reset();
    if (row.artefact == "dial") row.gauge_m = 1e-3;
    if (row.artefact == "drum") row.range_m = 1.2;
  }
  return data;
}

/// A model away from the declared one.
Model SomeModel(const Dataset& data) {
  Model model = Model::Declared(data);
  const Nuisances nuisances(data);
  Eigen::VectorXd step(nuisances.size());
  for (Eigen::Index k = 0; k < step.size(); ++k)
    step[k] = 0.1 * std::sin(1.0 + 3.0 * static_cast<double>(k));
  nuisances.Move(step, model);
  return model;
}

Dataset DatasetOf(const MeasuredCell& data) {
  Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  if (!dataset) FAIL(dataset.error());
  return std::move(dataset).value();
}

std::string ErrorOf(const MeasuredCell& data) {
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE_FALSE(dataset);
  return dataset.error();
}

/// A named row of the answer.
bool Lists(const std::vector<NotObservable>& all, const std::string& id,
           const std::string& parameter = "") {
  return std::any_of(all.begin(), all.end(), [&](const NotObservable& of) {
    const auto& names = of.parameters;
    return of.id == id &&
           (parameter.empty() || std::find(names.begin(), names.end(), parameter) != names.end());
  });
}

TEST_CASE("the kind of a row follows from its filled cells") {
  const Dataset data = DatasetOf(WithEveryKind());
  std::set<std::string> kinds;
  for (const RowIndex row : data.row_indices()) {
    kinds.insert(Describe(data.observations[row].kind));
    CHECK(data.numbers[row].count == ResidualsOf(data.observations[row].kind));
  }
  CHECK(kinds == std::set<std::string>{"position", "point", "sphere", "plane", "gauge", "range"});
}

TEST_CASE("the derivatives of every kind of row equal finite differences") {
  const Dataset data = DatasetOf(WithEveryKind());
  const Nuisances nuisances(data);
  const Model model = SomeModel(data);
  REQUIRE(nuisances.size() == 9 + 3 + 4 + 3 + 3 + 3);
  const Result<Linearisation> at = Linearise(data, model, false, 1);
  REQUIRE(at);
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd X;
  double largest = 0;
  for (int k = 0; k < nuisances.size(); ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(nuisances.size());
    std::array<Model, 2> moved = {model, model};
    step[k] = kStep;
    nuisances.Move(step, moved[0]);
    nuisances.Move(-step, moved[1]);
    const Result<Linearisation> up = Linearise(data, moved[0], false, 1);
    const Result<Linearisation> down = Linearise(data, moved[1], false, 1);
    for (const RowIndex row : data.row_indices()) {
      X.setZero(data.numbers[row].count, nuisances.size());
      nuisances.Fill(at->rows[row], row, X);
      const Eigen::VectorXd slope =
          (down->rows[row].residual - up->rows[row].residual) / (2 * kStep);
      largest = std::max(largest, (X.col(k) - slope).norm());
    }
    const std::vector<Equation> before = nuisances.EquationsAt(moved[1]);
    const std::vector<Equation> after = nuisances.EquationsAt(moved[0]);
    const std::vector<Equation> here = nuisances.EquationsAt(model);
    REQUIRE(static_cast<int>(here.size()) == nuisances.equations());
    for (std::size_t e = 0; e < here.size(); ++e) {
      double declared = 0;
      for (const auto& [nuisance, value] : here[e].slopes) declared += nuisance == k ? value : 0;
      const double slope = (before[e].residual - after[e].residual) / (2 * kStep);
      CHECK(declared == Approx(slope).margin(1e-2));
    }
  }
  // The deflection of the arm turns with the base, which the derivatives neglect.
  CHECK(largest < 3e-2);
}

TEST_CASE("a row with an artefact that the cell lacks is refused, with a remedy") {
  MeasuredCell data = WithEveryKind();
  data.table.rows[1].artefact = "bal";
  CHECK(ErrorOf(data) ==
        "line 3: artefact \"bal\" is not declared in the cell (did you mean \"ball\"?); add an "
        "[[artefact]] with that name, or correct the row");
  data = WithEveryKind();
  data.table.rows[7].gauge_m.reset();
  CHECK(ErrorOf(data).find("line 9: artefact \"dial\" is a gauge, but gauge_mm is empty") == 0);
  data = WithEveryKind();
  data.table.rows[3].range_m = 1.2;
  CHECK(ErrorOf(data).find("line 5: range_mm is filled, but artefact \"dome\" is of kind") == 0);
}

TEST_CASE("a row with a larger standard deviation of its own has less weight") {
  MeasuredCell data = Simulated("--family none --rows 30 --repeats 0 --seed 6 --unaligned");
  data.cell.measurement.sigma_m = 5e-5;
  data.table.recorded.sigma = true;
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    measure::MeasuredRow& row = data.table.rows[k];
    if (k % 3 != 0) continue;
    row.sigma_m = 5e-3;
    *row.measured_W += Vec3(0.004, -0.004, 0.003);
  }
  const Dataset weighted = DatasetOf(data);
  CHECK(weighted.numbers[RowIndex(0)].covariance(0, 0) == Approx(1e4));
  const Result<Model> aligned = Align(weighted, Model::Declared(weighted), 1);
  REQUIRE(aligned);
  const Result<Linearisation> linear = Linearise(weighted, *aligned, false, 1);
  for (const RowIndex row : weighted.row_indices()) {
    if (row.value() % 3 != 0) CHECK(linear->rows[row].residual.norm() < 4e-4);
  }
}

TEST_CASE("unknown sockets and tip are found, and known distances kept") {
  const MeasuredCell simulated = Simulated(
      "--family none --rows 60 --repeats 0 --seed 3 --artefacts sockets --places 4 --tool-unknown");
  MeasuredCell data = simulated;
  data.cell.tool.tcp_F += Vec3(0.03, -0.02, 0.04);
  const Dataset dataset = DatasetOf(data);
  const Result<Model> aligned = Align(dataset, Model::Declared(dataset), 1);
  REQUIRE(aligned);
  CHECK((aligned->frames.front().X_FT.front().p - simulated.cell.tool.tcp_F).norm() < 1e-4);
  for (const model::KnownDistance& distance : data.cell.distances) {
    const double apart = (aligned->artefacts[ArtefactIndex(distance.first)].place -
                          aligned->artefacts[ArtefactIndex(distance.second)].place)
                             .norm();
    CHECK(apart == Approx(0.05).margin(1e-4));
  }
}

TEST_CASE("an effect is named from sockets alone, and what they cannot show is named, too") {
  const MeasuredCell data = Simulated(
      "--family gear_ratio@q3 --rows 120 --repeats 0 --seed 4 --artefacts sockets --places 5 "
      "--tool-unknown --signal 15");
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kExplained);
  CHECK_FALSE(diagnosis->domain.residual_sigma_m);  // no row relates the base to W
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->findings[0].effect.term.effect->traits().id == "gear_ratio");
  REQUIRE(diagnosis->rms_by_kind.size() == 1);
  CHECK(diagnosis->rms_by_kind[0].kind == "point");
  CHECK(diagnosis->rms_by_kind[0].rows >= 110);
  CHECK(diagnosis->rms_after_m == Approx(diagnosis->rms_by_kind[0].after_m));
  // Turning the first joint turns all sockets with it; no instrument has a scale.
  CHECK(Lists(diagnosis->not_observable, "joint_offset", "q1"));
  CHECK(Lists(diagnosis->not_observable, "base_frame"));
  CHECK(Lists(diagnosis->not_observable, "measurement_scale"));
  CHECK_FALSE(Lists(diagnosis->not_observable, "scale"));  // sockets at known distances
  const auto held_out = [&](const HeldOutError& error) { return error.by == "places"; };
  CHECK(
      std::any_of(diagnosis->held_out_by_all.begin(), diagnosis->held_out_by_all.end(), held_out));
}

/// Five printed tools with two sockets each, 50 mm apart.
MeasuredCell SocketsWith(const std::string& family) {
  return Simulated("--family " + family +
                   " --rows 120 --repeats 0 --seed 4 --artefacts sockets --places 5 "
                   "--tool-unknown --signal 15");
}

bool AnyContains(const std::vector<std::string>& notes, const std::string& text) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

TEST_CASE("without any known distance, sockets show effects but not the size of the arm") {
  MeasuredCell data = SocketsWith("gear_ratio@q3");
  data.cell.distances.clear();
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kExplained);
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->findings[0].effect.term.effect->traits().id == "gear_ratio");
  CHECK(Lists(diagnosis->not_observable, "scale"));

  data = SocketsWith("none");
  data.cell.distances.clear();
  const Result<Diagnosis> nothing = Diagnose(data.cell, data.table, {});
  REQUIRE(nothing);
  CHECK(nothing->verdict == Verdict::kNoEffect);
}

TEST_CASE("a known distance that the others contradict is named and set aside") {
  MeasuredCell data = SocketsWith("gear_ratio@q3");
  data.cell.distances[2].value_m += 6e-4;
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kExplained);
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->findings[0].effect.term.effect->traits().id == "gear_ratio");
  CHECK(AnyContains(diagnosis->notes,
                    "set aside, because all other data contradict: the distance between tool2_0 "
                    "and tool2_1 is declared as 50.6 mm, but is"));
}

TEST_CASE("a place declared as exact that the others contradict is named and set aside") {
  MeasuredCell data = SocketsWith("none");
  const Dataset dataset = DatasetOf(data);
  const Result<Model> aligned = Align(dataset, Model::Declared(dataset), 1);
  REQUIRE(aligned);
  for (const ArtefactIndex k : aligned->artefacts.indices()) {
    data.cell.artefacts[k.offset()].place = aligned->artefacts[k].place;
  }
  const Result<Diagnosis> consistent = Diagnose(data.cell, data.table, {});
  REQUIRE(consistent);
  CHECK(consistent->references.contradicting.empty());
  CHECK(consistent->references.tested >= 10);
  data.cell.artefacts[3].place->x() += 1e-3;
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kNoEffect);
  CHECK(AnyContains(diagnosis->notes,
                    "set aside, because all other data contradict: the declared values of " +
                        data.cell.artefacts[3].name));
}

TEST_CASE("an effect that a single known distance makes is not called explained") {
  MeasuredCell data = SocketsWith("none");
  data.cell.distances.resize(1);
  data.cell.distances[0].value_m += 6e-4;
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->verdict == Verdict::kAmbiguous);
  CHECK(diagnosis->withheld.find("rests on the distance between tool0_0 and tool0_1") !=
        std::string::npos);
}

/// Moves the joints of the rows on an artefact, from its `first`-th row on, so that their tips are
/// shifted in the base frame; returns the line of that row.
int MoveArtefact(MeasuredCell& data, const std::string& name, int first, const Vec3& shift) {
  const Dataset dataset = DatasetOf(data);
  const Result<Linearisation> linear = Linearise(dataset, Model::Declared(dataset), true, 1);
  REQUIRE(linear);
  int touches = 0, line = 0;
  for (const RowIndex row : dataset.row_indices()) {
    measure::MeasuredRow& measured = data.table.rows[row.offset()];
    if (measured.artefact != name || touches++ < first) continue;
    if (line == 0) line = measured.line;
    const Eigen::Matrix3Xd J = linear->gradients[row].leftCols(data.cell.robot.size()).topRows(3);
    measured.q += J.transpose() * (J * J.transpose()).inverse() * (data.cell.robot.X_WB.R * shift);
  }
  REQUIRE(line > 0);
  return line;
}

TEST_CASE("an artefact that moved while it was measured is named, with the moment and the shift") {
  for (const char* family : {"none", "gear_ratio@q3"}) {
    CAPTURE(family);
    MeasuredCell data = SocketsWith(family);
    data.cell.measurement.sigma_m = 5e-5;
    const int line = MoveArtefact(data, "tool1_0", 5, Vec3(0, 5e-4, 0));
    const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
    REQUIRE_FALSE(diagnosis);
    CHECK_THAT(diagnosis.error(), Catch::Contains("the artefact tool1_0 moved by"));
    CHECK_THAT(diagnosis.error(), Catch::Contains("before line " + std::to_string(line) + ":"));
  }
}

TEST_CASE("outliers that are all on one artefact are unknown, not the absence of an effect") {
  MeasuredCell data = SocketsWith("none");
  int relabelled = 0;
  for (measure::MeasuredRow& row : data.table.rows) {
    if (row.artefact != "tool1_0" || relabelled == 5) continue;
    row.artefact = "tool1_1";  // 50 mm away
    ++relabelled;
  }
  const Result<Diagnosis> diagnosis = Diagnose(data.cell, data.table, {});
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  REQUIRE(diagnosis->misfit);
  CHECK(TextOf(diagnosis->misfit->condition) == "artefact tool1_1");
  CHECK(diagnosis->drivers.front() == "artefact");
  CHECK(AnyContains(diagnosis->notes, "it may have moved, or it is loose"));
}

TEST_CASE("a position in a row that names an artefact is used, which is noted") {
  MeasuredCell data = WithEveryKind();
  data.table.rows[4].artefact = "ball";
  CHECK(AnyContains(DatasetOf(data).notes,
                    "1 rows name an artefact beside a position (first: line 6)"));
}

TEST_CASE("quaternions in another order are refused, with the order that fits the joints") {
  MeasuredCell data = Simulated("--family none --rows 20 --repeats 0 --seed 6");
  data.cell.measurement.sigma_rad = 1e-4;
  data.table.recorded.orientation = true;
  const Dataset dataset = DatasetOf(data);
  const deflection::LoadedArm arm(data.cell);
  const Eigen::Quaterniond of_tool(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
  std::vector<Eigen::Quaterniond> truth;
  for (const RowIndex row : dataset.row_indices()) {
    deflection::LoadedState state;
    arm.AtActual(dataset.measured(row).q, dataset.payloads[row], dataset.conditions[row], state);
    truth.push_back(of_tool * Eigen::Quaterniond(state.X_WT.R) * of_tool);
  }
  const auto written_as = [&](const std::function<Eigen::Quaterniond(Eigen::Quaterniond)>& write) {
    for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
      data.table.rows[k].orientation_W = write(truth[k]);
    }
  };
  written_as([](const Eigen::Quaterniond& q) { return q; });
  DatasetOf(data);
  written_as(
      [](const Eigen::Quaterniond& q) { return Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()); });
  const std::string remedy = "if the quaternions are in the order x, y, z, w or inverted";
  CHECK(ErrorOf(data).find(remedy) != std::string::npos);
  written_as([](const Eigen::Quaterniond& q) { return q.conjugate(); });
  CHECK(ErrorOf(data).find(remedy) != std::string::npos);
}

}  // namespace
}  // namespace plumbline::artefact_rows_test
