#include "app/measure/siblings/siblings.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <random>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/siblings/prior_answer.h"
#include "app/measure/siblings/repeated_rows.h"
#include "app/measure/siblings/sibling_folder.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/measure/diagnosis/example_diagnosis.h"
#include "tests/app/measure/diagnosis/simulated.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::siblings_test {

using namespace plumbline::measure;
using measure::EffectWith;
using measure::MeasuredCell;

namespace {

constexpr double kSigma_m = 5e-5;

/// Rows of an arm with a compliance of joints 2 and 3 and a gear ratio error of joint 4.
MeasuredCell ArmWith(unsigned seed, double compliance, double ratio, int rows) {
  MeasuredCell data =
      measure::Simulated("--family none --robot ur10 --repeats 0 --tests 0 --rows " +
                         std::to_string(rows) + " --seed " + std::to_string(seed));
  Remeasure(
      data,
      {EffectWith(data.cell, "joint_compliance", {{"q2", compliance}, {"q3", 1.2 * compliance}}),
       EffectWith(data.cell, "gear_ratio", {{"q4", ratio}})},
      kSigma_m, seed);
  return data;
}

/// Gives `b` the poses of `a`, with readings that differ by the spread of two arms.
void Remeasured(const measure::MeasuredTable& a, measure::MeasuredTable& b) {
  std::mt19937_64 generator(11);
  std::normal_distribution<double> spread(0, 1e-4);
  for (std::size_t k = 0; k < b.rows.size(); ++k) {
    b.rows[k].q = a.rows[k].q;
    b.rows[k].measured_W =
        *a.rows[k].measured_W + Vec3(spread(generator), spread(generator), spread(generator));
  }
}

std::vector<Arm> ThreeSiblings() {
  std::vector<Arm> arms;
  for (unsigned k = 0; k < 3; ++k) {
    MeasuredCell data = ArmWith(70 + k, 2e-6 * (0.9 + 0.1 * k), 4e-4 * (1.1 - 0.1 * k), 40);
    arms.push_back({"arm" + std::to_string(k), data.cell, data.table, {}});
  }
  return arms;
}

Result<measure::Diagnosis> Answer(const MeasuredCell& data, std::vector<Arm> arms) {
  measure::DiagnosisOptions options;
  options.bootstrap = 20;
  options.next_poses = 0;
  return DiagnoseWithSiblings(data.cell, data.table, std::move(arms), measure::Diagnose, options);
}

}  // namespace

TEST_CASE("rows of another set are recognised among others, in any order and at other times") {
  const MeasuredCell arm = ArmWith(5, 2e-6, 4e-4, 40);
  const std::vector<model::Joint>& joints = arm.cell.robot.joints;
  const measure::MeasuredTable& a = arm.table;
  measure::MeasuredTable b = ArmWith(6, 2e-6, 4e-4, 40).table;  // another arm, other poses
  CHECK(RepeatedRows(a, b, joints) == 0);
  Remeasured(a, b);  // the same poses, measured on another arm
  CHECK(RepeatedRows(a, b, joints) == 0);
  for (std::size_t k = 0; k < 5; ++k) {
    b.rows[7 * k] = a.rows[k];
    b.rows[7 * k].t_s = 1e5 + static_cast<double>(k);
  }
  CHECK(RepeatedRows(a, b, joints) == 5);
  CHECK(RepeatedRows(b, a, joints) == 5);
  CHECK(IsRepeated(5, a.rows.size(), b.rows.size()));
  CHECK_FALSE(IsRepeated(4, 40, 60));
  CHECK_FALSE(IsRepeated(2, 4, 60));
  CHECK(RepeatedRows(a, a, joints) == a.rows.size());
}

TEST_CASE("a row copied with rounding, or with joints turned by whole turns, is recognised") {
  const MeasuredCell arm = ArmWith(5, 2e-6, 4e-4, 40);
  const std::vector<model::Joint>& joints = arm.cell.robot.joints;
  const auto rounded = [](double value, double step) { return std::round(value / step) * step; };
  measure::MeasuredTable copy = arm.table, other = arm.table;
  Remeasured(arm.table, other);
  for (measure::MeasuredTable* set : {&copy, &other}) {
    for (measure::MeasuredRow& row : set->rows) {
      for (double& coordinate : *row.measured_W) coordinate = rounded(coordinate, 1e-5);
      for (double& q : row.q) q = rounded(q / kRadPerDeg, 0.01) * kRadPerDeg;
      row.q[5] -= 360 * kRadPerDeg;
    }
  }
  CHECK(RepeatedRows(arm.table, copy, joints) == arm.table.rows.size());
  CHECK(RepeatedRows(copy, arm.table, joints) == arm.table.rows.size());
  CHECK_FALSE(IsRepeated(RepeatedRows(arm.table, other, joints), 40, 40));
  std::vector<model::Joint> sliding = joints;
  sliding[5].type = model::JointType::kPrismatic;  // its readings have no turns
  CHECK(RepeatedRows(arm.table, copy, sliding) == 0);
}

TEST_CASE(
    "the pooled spread is an upper limit in eight of ten fleets, and the mean is within its sd") {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0, 1);
  int covered = 0, above = 0;
  double variance = 0;
  constexpr int kFleets = 400, kArms = 6;
  for (int fleet = 0; fleet < kFleets; ++fleet) {
    std::vector<Estimate> estimates;
    for (int k = 0; k < kArms; ++k) {
      const double sd = k % 2 == 0 ? 0.1 : 0.3;
      estimates.push_back({2 + 0.5 * normal(generator) + sd * normal(generator), sd});
    }
    const auto pooled = PoolEstimates(estimates);
    REQUIRE(pooled);
    CHECK(pooled->arms == kArms);
    variance += pooled->between_sd * pooled->between_sd / kFleets;
    above += pooled->between_sd > 0.5 ? 1 : 0;
    covered += std::abs(pooled->mean - 2) < 2 * pooled->mean_sd ? 1 : 0;
  }
  CHECK(variance > 0.25);  // an upper limit
  CHECK(above > 0.74 * kFleets);
  CHECK(above < 0.87 * kFleets);
  CHECK(covered > 0.95 * kFleets);
  CHECK_FALSE(PoolEstimates(std::vector<Estimate>{{1, 0.1}}));
  const auto equal = PoolEstimates(std::vector<Estimate>{{1, 0.1}, {1, 0.1}});
  CHECK(equal->between_sd == Approx(kLeastSpread));
}

TEST_CASE("quantities of one fleet have a common spread, except those that contradict it") {
  std::mt19937_64 generator(6);
  std::normal_distribution<double> normal(0, 1);
  constexpr int kFleets = 400, kArms = 4, kSizes = 5;
  constexpr double kSpread = 0.06;
  int above = 0;
  double largest = 0, mean = 0;
  for (int fleet = 0; fleet < kFleets; ++fleet) {
    std::vector<std::vector<Estimate>> quantities(kSizes);
    for (int size = 0; size < kSizes; ++size) {
      for (int arm = 0; arm < kArms; ++arm) {
        const double sd = 0.02 * (size + 1), value = 1.0 + size;
        quantities[size].push_back(
            {value * (1 + kSpread * normal(generator)) + sd * normal(generator), sd});
      }
    }
    const auto common = CommonSpreadOf(quantities);
    REQUIRE(common);
    above += common->spread > kSpread ? 1 : 0;
    mean += common->spread / kFleets;
    largest = std::max(largest, common->spread);
  }
  CHECK(above > 0.74 * kFleets);
  CHECK(above < 0.87 * kFleets);
  CHECK(mean < 1.4 * kSpread);
  CHECK(largest < 3 * kSpread);
  // Neither a size that differs more than the others nor one near zero shares their spread.
  const std::vector<Estimate> alike{{1, 0.01}, {1.01, 0.01}, {0.99, 0.01}, {1, 0.01}};
  const std::vector<Estimate> apart{{1, 0.01}, {2, 0.01}, {0.5, 0.01}, {1.4, 0.01}};
  const std::vector<Estimate> zero{{0.1, 0.05}, {-0.1, 0.05}, {0.08, 0.05}, {-0.05, 0.05}};
  const auto common =
      CommonSpreadOf(std::vector<std::vector<Estimate>>{alike, apart, alike, zero, alike});
  REQUIRE(common);
  CHECK(common->shared_by == std::vector<bool>{true, false, true, false, true});
  CHECK(PoolEstimates(alike, common->spread)->between_sd == Approx(common->spread).epsilon(0.01));
  CHECK(PoolEstimates(apart)->between_sd > 0.5);
  CHECK(PoolEstimates(zero)->between_sd > 0.05);
  CHECK_FALSE(CommonSpreadOf(std::vector<std::vector<Estimate>>{alike, apart}));  // too few
}

TEST_CASE("the spread of sizes that are zero on average is an upper limit, or zero") {
  std::mt19937_64 generator(8);
  std::normal_distribution<double> normal(0, 1);
  constexpr int kFleets = 400, kEstimates = 20;
  int above = 0, zero = 0;
  for (int fleet = 0; fleet < kFleets; ++fleet) {
    std::vector<Estimate> spread, noise;
    for (int k = 0; k < kEstimates; ++k) {
      const double sd = k % 2 == 0 ? 0.5 : 1.5;
      spread.push_back({2 * normal(generator) + sd * normal(generator), sd});
      noise.push_back({sd * normal(generator), sd});
    }
    above += SpreadAboutZero(spread) > 2 ? 1 : 0;
    zero += SpreadAboutZero(noise) == 0 ? 1 : 0;
  }
  CHECK(above > 0.74 * kFleets);
  CHECK(above < 0.87 * kFleets);
  CHECK(zero > 0.13 * kFleets);  // one in five
  CHECK(zero < 0.27 * kFleets);
  CHECK(SpreadAboutZero({}) == 0);
}

TEST_CASE("what siblings share is adjusted to the arm, written with its origin, and improves it") {
  const MeasuredCell data = ArmWith(90, 2.1e-6, 3.8e-4, 12);
  const auto found = Answer(data, ThreeSiblings());
  INFO((found ? "" : found.error()));
  REQUIRE(found);
  REQUIRE(found->siblings);
  const measure::SiblingEvidence& evidence = *found->siblings;
  INFO(evidence.reason);
  CHECK(evidence.arms == std::vector<std::string>{"arm0", "arm1", "arm2"});
  REQUIRE(evidence.used);
  CHECK(evidence.predicted_m < 0.5 * evidence.declared_m);
  CHECK(evidence.held_out_with_m <= evidence.held_out_without_m);
  REQUIRE(found->findings.size() >= 2);
  for (std::size_t k = 0; k < 2; ++k) {
    const measure::Finding& finding = found->findings[k];
    CHECK(finding.origin == "siblings arm0, arm1, arm2");
    CHECK(finding.p_value < 0.01);
    CHECK(finding.tip_rms_m > 1e-4);
    CHECK(finding.tip_rms_of_each_m.size() == finding.effect.values.size());
    const model::WrittenEffect effect =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (const model::EffectParameter& parameter : effect.parameters) {
      CAPTURE(effect.id, parameter.name, parameter.value, parameter.sd.value_or(-1));
      const double truth = effect.id == "gear_ratio" ? 3.8e-4
                           : parameter.name == "q2"  ? 2.1e-6
                                                     : 1.2 * 2.1e-6;
      REQUIRE(parameter.sd);
      CHECK(std::abs(parameter.value - truth) < 4 * *parameter.sd);
    }
  }
  CHECK(found->verdict == measure::Verdict::kAmbiguous);  // not told from their rivals here
  CHECK(found->doubts.size() >= 2);
  CHECK_FALSE(found->domain.declared_sigma_m);  // the siblings' effects do not fade
  CHECK(found->rms_before_m > 2 * found->rms_after_m);
  CHECK(found->notes.front().find("siblings arm0, arm1, arm2: ") == 0);
}

TEST_CASE("an arm that differs from its siblings is diagnosed without them, and says so") {
  const MeasuredCell data = ArmWith(91, 0, -4e-4, 24);
  const auto found = Answer(data, ThreeSiblings());
  REQUIRE(found);
  const measure::SiblingEvidence& evidence = *found->siblings;
  INFO(evidence.reason);
  CHECK_FALSE(evidence.used);
  CHECK(evidence.reason.find("this arm differs from its siblings") != std::string::npos);
  measure::DiagnosisOptions options;
  options.bootstrap = 20;
  options.next_poses = 0;
  const auto alone = measure::Diagnose(data.cell, data.table, options);
  REQUIRE(alone);
  CHECK(found->verdict == alone->verdict);
  CHECK(found->findings.size() == alone->findings.size());
}

TEST_CASE("what an arm alone leaves unexplained is not noise of the fit that a prior starts") {
  measure::Diagnosis alone = test::ExampleDiagnosis(measure::Verdict::kUnknown);
  alone.sigma_m = 3e-4;
  alone.sigma_origin = "residual";
  alone.noise_floor_m = std::sqrt(3) * 5e-5;
  alone.noise_in_use_m = std::sqrt(3) * 3e-4;
  CHECK(FindingsOf(alone).sigma_m == Approx(5e-5));
  alone.sigma_m = 5e-5;
  alone.sigma_origin = "declared";
  CHECK(FindingsOf(alone).sigma_m == 5e-5);
}

TEST_CASE("beyond the prior, only confirmed causes are written, and nothing fades") {
  measure::Diagnosis with = test::ExampleDiagnosis(measure::Verdict::kAmbiguous);
  REQUIRE_FALSE(with.findings.empty());
  const std::string id(with.findings.front().effect.term.effect->traits().id);
  with.domain.residual_sigma_m = 1e-4;
  with.domain.declared_sigma_m = 2e-4;
  with.domain.applied_share = 0.7;
  with.sessions = {model::SessionFrames{}};
  with.sessions[0].X_WB_declared = Pose{Mat3::Identity(), Vec3(1, 2, 3)};
  const measure::HeldOutError held_out = with.held_out;
  RemoveUnconfirmed(with);
  CHECK(with.findings.empty());
  CHECK(with.rivals.empty());
  CHECK(with.doubts.empty());
  CHECK(with.notes.back().find("these rows suggest " + id) != std::string::npos);
  CHECK(with.held_out.after_m == Approx(held_out.before_m));
  CHECK(with.rms_after_m == with.rms_before_m);
  for (const measure::RowTrace& row : with.rows) CHECK(row.after == row.before);
  CHECK_FALSE(with.domain.declared_sigma_m);
  CHECK(with.domain.applied_share == 1);
  CHECK(*with.domain.residual_sigma_m == 2e-4);  // what the declared effects leave
  CHECK(with.sessions[0].X_WB.p == Vec3(1, 2, 3));
  CHECK_FALSE(with.sessions[0].X_WB_declared);

  measure::Diagnosis explained = test::ExampleDiagnosis(measure::Verdict::kExplained);
  explained.discrepancy.clear();
  const std::size_t findings = explained.findings.size();
  const double after_m = explained.held_out.after_m;
  RemoveUnconfirmed(explained);
  CHECK(explained.findings.size() == findings);
  CHECK(explained.held_out.after_m == after_m);
}

TEST_CASE("a correction withheld for its held-out rows says nothing against the prior") {
  measure::Diagnosis with = test::ExampleDiagnosis(measure::Verdict::kAmbiguous);
  with.held_out_by_all = {{"blocks of time", 1e-4, 2e-4, 1e-4, 3e-4}};
  CHECK_FALSE(WithheldByHeldOutRows(with));
  with.withheld = "held out by blocks of time, ..";
  CHECK(WithheldByHeldOutRows(with));
  with.held_out_by_all[0].after_m = 5e-5;  // so that the reason is another
  CHECK_FALSE(WithheldByHeldOutRows(with));
}

TEST_CASE("a sibling that cannot be diagnosed is named; one alone is not enough") {
  const MeasuredCell data = ArmWith(92, 2e-6, 4e-4, 12);
  std::vector<Arm> arms = ThreeSiblings();
  arms.resize(2);
  for (measure::MeasuredRow& row : arms[1].rows.rows) row.measured_W.reset();
  const auto found = Answer(data, std::move(arms));
  REQUIRE(found);
  const std::vector<std::string>& notes = found->notes;
  REQUIRE(notes.size() >= 2);
  CHECK(notes[0].find("at least two siblings that can be diagnosed are needed") !=
        std::string::npos);
  CHECK(notes[1].find("sibling arm1 was left out: ") == 0);
}

TEST_CASE("folders of siblings are read with faults that name the file; another model is refused") {
  const test::TemporaryFolder folder;
  config::FaultList faults;
  const auto missing = ReadArm(folder.path(), faults);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().find("cell.toml") != std::string::npos);
  CHECK(missing.error().find("a sibling is a folder with") != std::string::npos);
  const MeasuredCell ur10 = measure::Simulated("--family none --robot ur10 --rows 8 --seed 1");
  const MeasuredCell kr210 = measure::Simulated("--family none --robot kr210 --rows 8 --seed 1");
  CHECK(DifferenceOf(ur10.cell, ur10.cell).empty());
  CHECK(DifferenceOf(ur10.cell, kr210.cell) == "its nominal joint 1 differs");
  model::CellModel stiffer = ur10.cell;
  stiffer.robot.joints[1].compliance_rad_per_Nm = 9e-9;
  CHECK(DifferenceOf(ur10.cell, stiffer) == "the declared compliance of its joint 2 differs");
  model::CellModel corrected = ur10.cell;
  corrected.effects.emplace_back();
  CHECK(DifferenceOf(ur10.cell, corrected).find("its cell has effects of its own") == 0);
  model::CellModel shorter = ur10.cell;
  shorter.robot.joints.pop_back();
  CHECK(DifferenceOf(ur10.cell, shorter) == "it has 5 joints, not 6");
}

}  // namespace plumbline::siblings_test
