// Contents of an answer: detection limits, rivals, noise, held-out errors and p-values.
#include "app/measure/diagnosis/search/findings.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/diagnosis/output/answer.h"
#include "app/measure/diagnosis/output/summary.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::findings_test {

using namespace plumbline::measure;

namespace {

Result<Diagnosis> Answer(const MeasuredCell& data) {
  return Diagnose(data.cell, data.table, {});
}

double RmsOf(const std::vector<Vec3>& points) {
  double sum = 0;
  for (const Vec3& point : points) sum += point.squaredNorm();
  return std::sqrt(sum / static_cast<double>(points.size()));
}

/// Probability of at most `most` hits in `count` trials with probability `p`.
double ChanceOfAtMost(int most, int count, double p) {
  double sum = 0;
  for (int k = 0; k <= most; ++k) {
    sum += std::exp(std::lgamma(count + 1) - std::lgamma(k + 1) - std::lgamma(count - k + 1) +
                    k * std::log(p) + (count - k) * std::log(1 - p));
  }
  return sum;
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool Noted(const Diagnosis& diagnosis, const std::string& text) {
  return std::any_of(diagnosis.notes.begin(), diagnosis.notes.end(),
                     [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

}  // namespace

TEST_CASE("effects at the detection limit are found nine times of ten, for any joint and cycles") {
  constexpr double kPower = 0.9;
  const struct {
    const char* id;
    std::string name, cycles;
  } kinds[] = {{"gear_periodic", "q#_amplitude", "q#_cycles"}, {"joint_offset", "q#", ""}};
  for (const auto& kind : kinds) {
    int trials = 0, found = 0;
    for (int seed = 1; seed <= 3; ++seed) {
      const MeasuredCell clean =
          Simulated("--family none --robot ur10 --rows 90 --seed " + std::to_string(seed));
      const auto nothing = Answer(clean);
      REQUIRE(nothing);
      const double limit_m = nothing->minimum_detectable_m.at(kind.id);
      for (int joint = 0; joint < 5; ++joint) {
        const auto named = [&](std::string name) {
          name.replace(name.find('#'), 1, std::to_string(joint + 1));
          return name;
        };
        std::vector<std::pair<std::string, double>> values = {{named(kind.name), 1e-4}};
        if (!kind.cycles.empty()) values.emplace_back(named(kind.cycles), 7.3 + 3 * joint + seed);
        const effects::ActiveEffect effect = EffectWith(clean.cell, kind.id, values);
        MeasuredCell data = clean;
        const std::vector<Vec3> moved = DisplacementBy(clean, {effect});
        const double scale = limit_m / RmsOf(moved);
        for (std::size_t k = 0; k < moved.size(); ++k)
          *data.table.rows[k].measured_W += scale * moved[k];
        const auto diagnosis = Answer(data);
        REQUIRE(diagnosis);
        ++trials;
        found += diagnosis->verdict == Verdict::kNoEffect ? 0 : 1;
      }
    }
    CAPTURE(kind.id, found, trials);
    CHECK(ChanceOfAtMost(found, trials, kPower) > 1e-3);
  }
}

TEST_CASE("a constant shift is of the base, not a drift, whenever the clock started") {
  for (const double start_s : {0.0, 20000.0}) {
    CAPTURE(start_s);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --seed 77");
    for (measure::MeasuredRow& row : data.table.rows) {
      *row.measured_W += Vec3(3e-4, -5e-4, 2e-4);
      *row.t_s += start_s;
    }
    const auto answer = Answer(data);
    REQUIRE(answer);
    CHECK(answer->verdict == Verdict::kExplained);
    REQUIRE(answer->findings.size() == 1);
    CHECK(answer->findings.front().effect.term.effect->traits().id == "base_frame");
    CHECK(answer->rivals.empty());
  }
  const auto drift =
      Answer(Simulated("--family thermal_drift --signal 8 --robot ur10 --rows 40 --seed 77"));
  REQUIRE(drift);
  REQUIRE(drift->findings.size() == 1);
  CHECK(drift->findings.front().effect.term.effect->traits().id == "thermal_drift");
}

TEST_CASE("steps of base and tool are distinguished only if the poses rotate the tool") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 80 --repeats 0 --seed 3");
  const model::JointVector middle = data.table.rows.front().q;
  const double half_time_s = data.table.rows[data.table.rows.size() / 2].t_s.value() - 1e-3;
  const effects::ActiveEffect step =
      EffectWith(data.cell, "step_event",
                 {{"time", half_time_s}, {"x", 4e-4}, {"y", 0}, {"z", 3.3e-4}}, "tool");
  for (const double half_range_deg : {0.5, 40.0}) {
    CAPTURE(half_range_deg);
    std::mt19937_64 generator(11);
    std::uniform_real_distribution<double> within(-half_range_deg, half_range_deg);
    for (measure::MeasuredRow& row : data.table.rows) {
      row.q = middle;
      for (double& q : row.q) q += within(generator) * 0.017453;
    }
    Remeasure(data, {step}, 5e-5, 12);
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    REQUIRE(diagnosis->findings.size() == 1);
    REQUIRE(diagnosis->findings[0].effect.term.effect->traits().id == "step_event");
    if (half_range_deg > 1) {
      CHECK(diagnosis->verdict == Verdict::kExplained);
      CHECK(diagnosis->findings[0].effect.term.word == "tool");
      continue;
    }
    CHECK(diagnosis->verdict == Verdict::kAmbiguous);
    const auto rival =
        std::find_if(diagnosis->rivals.begin(), diagnosis->rivals.end(), [&](const Rival& other) {
          return other.id == "step_event" && other.instead_of == "step_event" &&
                 other.word != diagnosis->findings[0].effect.term.word;
        });
    REQUIRE(rival != diagnosis->rivals.end());
    CHECK(AnswerJson(*diagnosis, "").find("\"word\": \"" + rival->word) != std::string::npos);
    CHECK(Headline(*diagnosis).find("(base)") != std::string::npos);
    CHECK(Headline(*diagnosis).find("(tool)") != std::string::npos);
    // Each rival is listed once, however many of its shapes scored close.
    std::set<std::tuple<std::string, std::string, std::string, std::string>> listed;
    for (const Rival& other : diagnosis->rivals) {
      CHECK(listed.emplace(other.instead_of, other.instead_of_word, other.id, other.word).second);
    }
  }
}

namespace {

/// Rows of two tools, and a cell that declares the tip of the second at an error from the true one.
MeasuredCell OfTwoTools(bool alternating, const Vec3& error_F,
                        const std::vector<std::pair<std::string, double>>& offsets, unsigned seed) {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --seed 21");
  data.cell.tool = model::Tool();
  data.cell.tool.tcp_F = Vec3(0.03, 0, 0.22);
  data.cell.tool.number = 1;
  model::Tool second = data.cell.tool;
  second.tcp_F = Vec3(0, 0.08, 0.35);
  second.number = 2;
  data.cell.further_tools = {second};
  data.table.recorded.tool = true;
  const std::size_t count = data.table.rows.size();
  for (std::size_t k = 0; k < count; ++k) {
    const bool is_second = alternating ? k % 2 == 1 : 2 * k >= count;
    data.table.rows[k].tool_number = is_second ? 2 : 1;
  }
  data.cell.measurement.sigma_m = 5e-5;
  std::vector<effects::ActiveEffect> effects;
  if (!offsets.empty()) effects = {EffectWith(data.cell, "joint_offset", offsets)};
  Remeasure(data, effects, 5e-5, seed);
  data.cell.further_tools.front().tcp_F -= error_F;
  return data;
}

}  // namespace

TEST_CASE("the wrong tip of one of several tools is named and not taken for an effect") {
  const Vec3 error_F(8e-4, -4e-4, 5e-4);
  const auto alternating = Answer(OfTwoTools(true, error_F, {}, 1));
  REQUIRE_FALSE(alternating);
  CHECK(Contains(alternating.error(), "the tip of tool 2 is (0."));
  // Rows of one tool after the other: a step when the tools were changed fits as well.
  const auto in_turn = Answer(OfTwoTools(false, error_F, {}, 2));
  if (in_turn) {
    CHECK(in_turn->verdict == Verdict::kAmbiguous);
    CHECK(Contains(in_turn->withheld, "the tip of tool 2 is (0."));
  } else {
    CHECK(Contains(in_turn.error(), "the tip of tool 2 is (0."));
  }
}

TEST_CASE("correct tips of two tools are not doubted, with or without an effect") {
  for (const bool alternating : {true, false}) {
    const auto sound = Answer(OfTwoTools(alternating, Vec3::Zero(), {}, 3));
    REQUIRE(sound);
    CHECK(sound->verdict == Verdict::kNoEffect);
    const auto offset = Answer(OfTwoTools(alternating, Vec3::Zero(), {{"q2", 4e-4}}, 4));
    REQUIRE(offset);
    CHECK(offset->verdict == Verdict::kExplained);
    CHECK(offset->withheld.empty());
  }
}

TEST_CASE("the wrong mass of one payload item is named; correct masses are not doubted") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --seed 23");
  for (model::Joint& joint : data.cell.robot.joints) joint.compliance_rad_per_Nm = 3e-5;
  data.cell.payload_items = {{7, 5.0, Vec3(-0.08, 0.06, 0.1)}, {9, 4.0, Vec3(0, 0.1, 0.2)}};
  data.table.recorded.item = true;
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    data.table.rows[k].payload_kg.reset();
    data.table.rows[k].payload_item = std::array{0, 7, 9}[k * 7 % 3];
  }
  data.table.recorded.payload = false;
  data.cell.measurement.sigma_m = 5e-5;
  Remeasure(data, {}, 5e-5, 5);
  const auto sound = Answer(data);
  REQUIRE(sound);
  CHECK(sound->verdict == Verdict::kNoEffect);
  MeasuredCell with_offset = data;
  Remeasure(with_offset, {EffectWith(data.cell, "joint_offset", {{"q2", 4e-4}})}, 5e-5, 6);
  const auto offset = Answer(with_offset);
  REQUIRE(offset);
  CHECK_FALSE(Contains(offset->withheld, "payload item"));
  data.cell.payload_items[0].mass_kg = 3.5;
  const auto wrong = Answer(data);
  REQUIRE_FALSE(wrong);
  CAPTURE(wrong.error());
  const std::string start = "payload item 7 has a mass of about ";
  REQUIRE(Contains(wrong.error(), start));
  CHECK(std::stod(wrong.error().substr(wrong.error().find(start) + start.size())) ==
        Approx(5).margin(0.3));
}

TEST_CASE("an orientation that is turned on the tool is not taken for an effect") {
  constexpr double kSigma_m = 5e-5, kSigma_rad = 2e-4;
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 45 --repeats 0 --seed 3");
  Remeasure(data, {}, kSigma_m, 5);
  data.cell.measurement.kind = model::MeasurementKind::kPose;
  data.cell.measurement.sigma_m = kSigma_m;
  data.cell.measurement.sigma_rad = kSigma_rad;
  data.table.recorded.orientation = true;
  const deflection::LoadedArm arm(data.cell);
  std::mt19937_64 generator(9);
  std::normal_distribution<double> noise(0, kSigma_rad);
  const auto orient = [&](const Vec3& turn_F) {
    for (measure::MeasuredRow& row : data.table.rows) {
      const loads::Payload payload =
          loads::LoadOf(data.cell, row.payload_kg, row.tool_number, row.payload_item);
      deflection::LoadedStateOf<double> state;
      REQUIRE(arm.AtCommanded(row.q, payload, nullptr, {}, state));
      const Vec3 off(noise(generator), noise(generator), noise(generator));
      row.orientation_W =
          Eigen::Quaterniond(RotationFromVector(off) * state.X_WT.R * RotationFromVector(turn_F));
    }
  };
  orient(Vec3::Zero());
  const auto sound = Answer(data);
  REQUIRE(sound);
  CHECK(sound->verdict == Verdict::kNoEffect);
  orient(Vec3(kRadPerDeg, 0, 0));
  const auto turned = Answer(data);
  REQUIRE_FALSE(turned);
  CHECK(Contains(turned.error(), "the measured orientation is turned on the tool by 1.0"));
  // About the last axis, on which the tip is, an offset of the last joint fits as well.
  orient(Vec3(0, 0, 2 * kRadPerDeg));
  const auto about_axis = Answer(data);
  REQUIRE(about_axis);
  CHECK(about_axis->verdict == Verdict::kAmbiguous);
  CHECK(Contains(about_axis->withheld, "the measured orientation is turned on the tool by 2.0"));
}

TEST_CASE("declared noise that the rows contradict is reported as too small") {
  const char* options = "--family none --robot ur10 --rows 60 --sigma-mm 0.05 --seed 2 --repeats ";
  MeasuredCell data = Simulated(std::string(options) + "0");
  const auto right = Answer(data);
  REQUIRE(right);
  CHECK(right->verdict == Verdict::kNoEffect);
  CHECK_FALSE(right->declared_noise_too_small);
  CHECK(Headline(*right).find("noise of 0.087 mm") != std::string::npos);
  for (const auto& [sigma_m, text] : {std::pair{3e-5, "0.052"}, {1.5e-5, "0.026"}}) {
    CAPTURE(sigma_m);
    data.cell.measurement.sigma_m = sigma_m;
    const auto contradicted = Answer(data);
    REQUIRE(contradicted);
    CHECK(contradicted->verdict == Verdict::kUnknown);
    const std::string headline = Headline(*contradicted);
    CHECK_FALSE(Contains(headline, "noise of " + std::string(text) + " mm;"));
    CHECK(Contains(headline, "the declared noise of " + std::string(text) + " mm is too small"));
  }
}

TEST_CASE("a large residual without a driver is unknown if replicates confirm the noise") {
  MeasuredCell data =
      Simulated("--family none --robot ur10 --rows 60 --sigma-mm 0.05 --seed 2 --repeats 0");
  data.cell.measurement.sigma_m = 5e-6;
  // Every point is measured twice, repeats within the declared noise, and has an error of 0.05 mm.
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0, 5e-6);
  const auto once = data.table.rows;
  for (measure::MeasuredRow row : once) {
    *row.t_s += 1e5;
    for (double& x : *row.measured_W) x += noise(generator);
    data.table.rows.push_back(row);
  }
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  CHECK(diagnosis->drivers.empty());
  // With the declared noise, the replicates scatter as much as the residual and nothing is unknown.
  for (int seed = 1; seed <= 3; ++seed) {
    const auto right = Answer(
        Simulated("--family none --robot ur10 --rows 60 --sigma-mm 0.05 --repeats 40 --seed " +
                  std::to_string(seed)));
    REQUIRE(right);
    // Whether an effect is found in noise is another matter (tests/evaluation counts it).
    CHECK(right->verdict != Verdict::kUnknown);
    CHECK_FALSE(right->declared_noise_too_small);
  }
}

TEST_CASE("the held-out error includes only rows predicted by a fit without them") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 20 --repeats 0 --seed 8");
  data.table.rows.resize(4);  // three others for each row: too few to train on
  const auto few = Answer(data);
  REQUIRE(few);
  CHECK(few->held_out_by.empty());
  for (const RowTrace& row : few->rows) CHECK(row.fold == -1);
  CHECK(AnswerJson(*few, "").find("\"after_held_out\": null") != std::string::npos);
  data = Simulated("--family none --robot ur10 --rows 20 --repeats 0 --seed 8");
  const auto more = Answer(data);
  REQUIRE(more);
  CHECK_FALSE(more->held_out_by.empty());
  for (const RowTrace& row : more->rows) CHECK(row.fold >= 0);
}

TEST_CASE("rejected rows extend neither domain, time span nor the range of proposed poses") {
  MeasuredCell data =
      Simulated("--family tool_stiffness --seed 1 --signal 15 --one-payload --rigid-joints");
  double highest = -1e9;
  for (const measure::MeasuredRow& row : data.table.rows) highest = std::max(highest, row.q[0]);
  measure::MeasuredRow wrong = data.table.rows.back();
  wrong.q[0] = highest + 1;
  *wrong.t_s += 1e6;
  wrong.line += 1;
  data.table.rows.push_back(wrong);
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  REQUIRE(diagnosis->outlier_rows == std::vector<int>{wrong.line});
  CHECK(diagnosis->domain.q[0].high == highest);
  REQUIRE_FALSE(diagnosis->next_poses.empty());
  double lowest = 1e9;
  for (const measure::MeasuredRow& row : data.table.rows) lowest = std::min(lowest, row.q[0]);
  for (const NextPose& pose : diagnosis->next_poses) {
    CHECK(pose.q[0] <= highest + 0.25 * (highest - lowest));
  }
  MeasuredCell drifts = Simulated("--family thermal_drift --signal 20 --seed 3");
  double last_of_drift_s = -1e9;
  for (const measure::MeasuredRow& row : drifts.table.rows)
    last_of_drift_s = std::max(last_of_drift_s, *row.t_s);
  drifts.table.rows.push_back(drifts.table.rows.back());
  drifts.table.rows.back().t_s = 2 * last_of_drift_s;
  drifts.table.rows.back().measured_W->x() += 0.02;
  const auto drift = Answer(drifts);
  REQUIRE(drift);
  REQUIRE(drift->findings.size() == 1);
  REQUIRE(drift->findings[0].effect.seen_t_s);
  CHECK(drift->findings[0].effect.seen_t_s->high == last_of_drift_s);
}

TEST_CASE("a line along a joint that moves on a grid is ambiguous, and the radius shows it") {
  constexpr double kSigma_m = 5e-5, kGrid_rad = 15 * kRadPerDeg;
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
  const auto grid = [&](double q) { return kGrid_rad * std::round(q / kGrid_rad); };
  const effects::ActiveEffect line = EffectWith(
      data.cell, "gear_periodic", {{"q1_amplitude", 5e-4}, {"q1_cycles", 25}, {"q1_phase", 0.3}});
  Remeasure(data, {line}, kSigma_m, 7);
  const auto spread = Answer(data);
  REQUIRE(spread);
  CHECK(spread->verdict == Verdict::kExplained);

  for (measure::MeasuredRow& row : data.table.rows) row.q[0] = grid(row.q[0]);
  Remeasure(data, {line}, kSigma_m, 7);
  const auto on_grid = Answer(data);
  REQUIRE(on_grid);
  CHECK(on_grid->verdict == Verdict::kAmbiguous);
  CHECK(Noted(*on_grid, "the readings of q1 are equally spaced"));
  REQUIRE(on_grid->domain.residual_sigma_m);
  CHECK(*on_grid->domain.residual_sigma_m > 3 * *spread->domain.residual_sigma_m);
  CHECK(on_grid->next_poses_separate_all);
}

TEST_CASE("between the points of a grid the radius includes the aliases of a line") {
  constexpr double kSigma_m = 5e-5, kGrid_rad = 15 * kRadPerDeg;
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
  for (measure::MeasuredRow& row : data.table.rows) {
    row.q[0] = kGrid_rad * std::round(row.q[0] / kGrid_rad);
  }
  const effects::ActiveEffect line = EffectWith(
      data.cell, "gear_periodic", {{"q1_amplitude", 5e-4}, {"q1_cycles", 25}, {"q1_phase", 0.3}});
  Remeasure(data, {line}, kSigma_m, 7);
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  std::vector<effects::ActiveEffect> found;
  for (const Finding& finding : diagnosis->findings) found.push_back(finding.effect);
  // The measured poses, each half a grid step aside.
  MeasuredCell aside = data;
  for (measure::MeasuredRow& row : aside.table.rows) row.q[0] += kGrid_rad / 2;
  const std::vector<Vec3> truth = DisplacementBy(aside, {line});
  const std::vector<Vec3> predicted = DisplacementBy(aside, found);
  int held = 0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    constexpr double kQuantile = 2.8;  // of the chi distribution with three degrees of freedom
    const double radius_m = kQuantile * *diagnosis->domain.residual_sigma_m;
    held += (truth[k] - predicted[k]).norm() <= radius_m ? 1 : 0;
  }
  CHECK(held >= 0.85 * static_cast<double>(truth.size()));
}

TEST_CASE("rejected rows that share a payload make the verdict unknown, scattered ones do not") {
  for (const bool share : {true, false}) {
    CAPTURE(share);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
    for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
      data.table.rows[k].payload_kg = k % 2 == 0 ? 2 : 4;
      if (share && k % 17 == 3) data.table.rows[k].payload_kg = 8;
    }
    Remeasure(data, {}, 5e-5, 7);
    std::size_t at = 3;  // 3, 20, 37, 54
    for (const double size_m : {2e-3, -3e-3, 2.5e-3, -2e-3}) {
      *data.table.rows[at].measured_W += Vec3(size_m, -size_m, size_m / 2);
      at += 17;
    }
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    CHECK(diagnosis->outlier_rows.size() == 4);
    CHECK(diagnosis->verdict == (share ? Verdict::kUnknown : Verdict::kNoEffect));
    CHECK(diagnosis->drivers ==
          (share ? std::vector<std::string>{"payload_kg"} : std::vector<std::string>{}));
    CHECK(diagnosis->domain.payload_kg->Hull().high ==
          4);  // at 8 kg, all rows contradict the others
  }
}

TEST_CASE("rejected rows of one rare tool or session make the verdict unknown") {
  for (const std::string column : {"tool", "session"}) {
    CAPTURE(column);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 120 --repeats 0 --seed 5");
    model::Tool second = data.cell.tool;
    data.cell.tool.number = 1;
    second.number = 2;
    if (column == "tool") data.cell.further_tools = {second};
    data.table.recorded.tool = column == "tool";
    std::vector<std::size_t> rare;
    for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
      const bool is_rare = column == "tool" ? k % 15 == 4 : k >= 60 && k < 68;
      if (is_rare) rare.push_back(k);
      if (column == "tool") data.table.rows[k].tool_number = is_rare ? 2 : 1;
      if (column == "session") data.table.rows[k].session = is_rare ? "second" : "first";
    }
    Remeasure(data, {}, 5e-5, 7);
    double sign = 1;  // no constant error of the tip
    for (const std::size_t k : rare) {
      *data.table.rows[k].measured_W += sign * Vec3(2e-3, -3e-3, 2e-3);
      sign = -sign;
    }
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    CHECK(diagnosis->outlier_rows.size() == rare.size());
    CHECK(diagnosis->verdict == Verdict::kUnknown);
    CHECK(diagnosis->drivers == std::vector<std::string>{column});
  }
}

TEST_CASE("the displacement by an effect is that of the tip, for all its values and for each") {
  const MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --repeats 0 --seed 5");
  const auto rms_m = [&](const std::vector<std::pair<std::string, double>>& values) {
    double squares = 0;
    const auto moved = DisplacementBy(data, {EffectWith(data.cell, "joint_offset", values)});
    for (const Vec3& by : moved) squares += by.squaredNorm() / static_cast<double>(moved.size());
    return std::sqrt(squares);
  };
  const Result<Dataset> rows = DatasetFrom(data.cell, data.table);
  REQUIRE(rows);
  const TipDisplacement found =
      TipDisplacementOf(UnitWeightFit(*rows, 1),
                        EffectWith(data.cell, "joint_offset", {{"q2", 1e-4}, {"q3", -2e-4}}));
  CHECK(found.all_m == Approx(rms_m({{"q2", 1e-4}, {"q3", -2e-4}})).epsilon(1e-2));
  REQUIRE(found.each_m.size() == 2);
  CHECK(found.each_m[0] == Approx(rms_m({{"q2", 1e-4}})).epsilon(1e-2));
  CHECK(found.each_m[1] == Approx(rms_m({{"q3", -2e-4}})).epsilon(1e-2));
}

TEST_CASE("an instrument that is not level is noted, with the angle") {
  for (const double tilt_deg : {0.0, 5.0}) {
    CAPTURE(tilt_deg);
    MeasuredCell data = Simulated("--family none --robot ur10 --rows 40 --repeats 0 --seed 5");
    Remeasure(data, {}, 5e-5, 7);
    data.cell.measurement.frame_known = false;
    const Mat3 R = RotationFromVector(tilt_deg * kRadPerDeg * Vec3::UnitX());
    for (measure::MeasuredRow& row : data.table.rows) *row.measured_W = R * *row.measured_W;
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    const auto noted =
        std::find_if(diagnosis->notes.begin(), diagnosis->notes.end(), [](const std::string& note) {
          return note.find("level the instrument") != std::string::npos;
        });
    CHECK((noted != diagnosis->notes.end()) == (tilt_deg > 2));
    if (noted != diagnosis->notes.end())
      CHECK_THAT(*noted, Catch::Contains("differs by 5.0 deg from the declared one"));
  }
}

TEST_CASE("a run of rejected rows while a signal drifts is no condition") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    data.table.rows[k].temp_C = 20 + 0.1 * static_cast<double>(k);
  }
  Remeasure(data, {}, 5e-5, 7);
  for (std::size_t k = 30; k < 36; ++k) *data.table.rows[k].measured_W += Vec3(2e-3, -1e-3, 1e-3);
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->outlier_rows.size() == 6);
  CHECK(diagnosis->verdict == Verdict::kNoEffect);
}

TEST_CASE("rejected rows without a recorded condition leave the verdict as it is") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 70 --repeats 0 --seed 5");
  data.table.recorded.temperature = data.table.recorded.payload = false;
  for (measure::MeasuredRow& row : data.table.rows) {
    row.temp_C.reset();
    row.payload_kg.reset();
  }
  Remeasure(data, {}, 5e-5, 7);
  for (const std::size_t at : {8, 27, 51}) data.table.rows[at].measured_W->z() += 3e-3;
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->outlier_rows.size() == 3);
  CHECK(diagnosis->verdict == Verdict::kNoEffect);
  CHECK(diagnosis->drivers.empty());
}

TEST_CASE("a residual far beyond the declared noise is unknown unless repeats confirm it") {
  for (const bool repeats : {true, false}) {
    for (const bool effect : {true, false}) {
      CAPTURE(repeats, effect);
      MeasuredCell data =
          Simulated("--family none --robot ur10 --rows 60 --seed 5 --sigma-mm 0.02 --repeats " +
                    std::string(repeats ? "30" : "0"));
      std::vector<effects::ActiveEffect> effects;
      if (effect) effects.push_back(EffectWith(data.cell, "gear_ratio", {{"q2", 2e-3}}));
      Remeasure(data, effects, 1e-4, 7);
      const auto diagnosis = Answer(data);
      REQUIRE(diagnosis);
      CHECK(diagnosis->declared_noise_too_small);
      CHECK(diagnosis->findings.size() == (effect ? 1 : 0));
      const Verdict confirmed = effect ? Verdict::kExplained : Verdict::kNoEffect;
      CHECK(diagnosis->verdict == (repeats ? confirmed : Verdict::kUnknown));
      CHECK(Contains(SummaryText(*diagnosis, {data.cell}), "repeat one pose ten times"));
    }
  }
}

TEST_CASE("named effects that leave more than replicates scatter do not explain the residual") {
  MeasuredCell data =
      Simulated("--family none --robot ur10 --rows 80 --seed 5 --sigma-mm 0.05 --repeats 20");
  data.table.recorded.temperature = false;
  const auto effect = EffectWith(data.cell, "gear_ratio", {{"q2", 2e-3}});
  Remeasure(data, {effect}, 6e-5, 7);
  const auto sound = Answer(data);
  REQUIRE(sound);
  CHECK(sound->verdict == Verdict::kExplained);
  // An error of each pose that no effect of the catalogue causes, 0.12 mm RMS.
  for (measure::MeasuredRow& row : data.table.rows) {
    const model::JointVector& q = row.q;
    *row.measured_W += 1e-4 * Vec3(std::sin(3 * q[0] + 2 * q[3]), std::cos(2 * q[1] - 3 * q[5]),
                                   std::sin(4 * q[4] + 3 * q[2]));
  }
  const auto diagnosis = Answer(data);
  REQUIRE(diagnosis);
  CHECK(diagnosis->verdict == Verdict::kUnknown);
  REQUIRE(diagnosis->findings.size() == 1);
  CHECK(diagnosis->findings[0].effect.term.effect->traits().id == "gear_ratio");
  const auto failed = std::find_if(diagnosis->checks.begin(), diagnosis->checks.end(),
                                   [](const ExplanationCheck& check) { return !check.passed; });
  REQUIRE(failed != diagnosis->checks.end());
  CHECK(failed->name == "lack_of_fit");
  CHECK(Contains(Headline(*diagnosis), "an effect outside the catalogue"));
}

TEST_CASE("a note names effects that are easily confused with the answer but cannot be tested") {
  MeasuredCell data =
      Simulated("--family none --robot ur10 --rows 60 --seed 5 --sigma-mm 0.05 --repeats 0");
  const auto effect = EffectWith(data.cell, "measurement_scale", {{"scale", 3e-4}});
  const auto noted = [&] {
    Remeasure(data, {effect}, 5e-5, 7);
    const auto diagnosis = Answer(data);
    REQUIRE(diagnosis);
    REQUIRE(diagnosis->verdict == Verdict::kExplained);
    return std::any_of(diagnosis->notes.begin(), diagnosis->notes.end(), [](const auto& note) {
      return Contains(note,
                      "not testable with these rows: thermal growth (temp_C was not recorded");
    });
  };
  CHECK_FALSE(noted());
  data.table.recorded.temperature = false;
  CHECK(noted());
}

TEST_CASE("the p-value is corrected for the choice of joints") {
  const MeasuredCell data = Simulated("--family none --robot ur10 --rows 60 --seed 5");
  const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
  REQUIRE(dataset);
  const Model model = Model::Declared(*dataset);
  const Result<Linearisation> linear = Linearise(*dataset, model, true, 1);
  REQUIRE(linear);
  FitProblem fit = UnitWeightFit(*dataset, 1);
  fit.sigma_m = 5e-5;
  const LinearProblem problem(std::move(fit), std::make_shared<const Linearisation>(*linear),
                              model);
  CandidateSet candidate_set(problem);
  const Candidates candidates = CandidatesFor(*dataset);
  const auto offsets = std::find_if(candidates.blocks.begin(), candidates.blocks.end(),
                                    [](const Block& block) { return block.id == "joint_offset"; });
  REQUIRE(offsets != candidates.blocks.end());
  const BlockIndex block = candidate_set.Add(*offsets);
  Explanation all = candidate_set.Fit({block});
  const auto visible = static_cast<double>(all.columns.size());
  REQUIRE(visible >= 5);
  CHECK(LogChoices(candidate_set, all, block) == Approx(0).margin(1e-12));
  all.columns.resize(2);
  CHECK(LogChoices(candidate_set, all, block) == Approx(std::log(visible * (visible - 1) / 2)));
}

}  // namespace plumbline::findings_test
