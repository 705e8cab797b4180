#include "firmware-like/correction/correct.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "firmware-like/correction/cell_corrector.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/inverse.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::correct_test {

using namespace plumbline::correction;

namespace {

AssemblyPoint PointAt(const model::CellModel& cell, const model::JointVector& q,
                      const Vec3& p_TP = Vec3::Zero()) {
  const Pose X_BT = deflection::LoadedArm(cell).UnloadedTip(q);
  AssemblyPoint point;
  point.id = 1;
  point.p_TP = p_TP;
  point.X_WP = cell.robot.X_WB * Pose{X_BT.R, X_BT * p_TP};
  return point;
}

Correction Solve(const model::CellModel& cell, const AssemblyPoint& point,
                 const model::JointVector& seed, const CorrectionLimits& limits = {},
                 double payload_kg = 60) {
  Correction correction;
  Corrector(cell, limits)
      .Correct(point, {payload_kg, *cell.payload_cog_F}, {}, seed, BranchSearch::kBrief,
               correction);
  return correction;
}

/// Simulated controller: rigid inverse kinematics of the commanded pose; the loaded arm then
/// deflects.
Pose Landed(const model::CellModel& cell, const Pose& X_BP_command, const Vec3& p_TP,
            const model::JointVector& seed, double payload_kg = 60) {
  const deflection::LoadedArm arm(cell);
  model::JointVector q = seed;
  const auto rigid = [&](const model::JointVector& trial, kinematics::Posture& posture) {
    arm.chain().Evaluate(trial, posture);
    const Pose X_BT = posture.X_BF() * arm.X_FT();
    return Pose{X_BT.R, X_BT * p_TP};
  };
  REQUIRE(kinematics::SolvePose(arm.chain(), {X_BP_command}, rigid, 60, q).converged);
  deflection::LoadedState state;
  REQUIRE(arm.AtCommanded(q, {payload_kg, *cell.payload_cog_F}, {}, state));
  return {state.X_BT.R, state.X_BT * p_TP};
}

}  // namespace

TEST_CASE("the corrected command makes the loaded tool point land within 1 um and 1 urad") {
  std::mt19937 random(20);
  model::CellModel cell = test::HeavyArm();
  if (GENERATE(false, true)) cell.robot.couplings = {{2, 1, 1.0}, {5, 4, 0.1}};
  int corrected = 0;
  double largest_m = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const Vec3 p_TP(0.1, -0.4, 0.05);
    const AssemblyPoint point = PointAt(cell, q, p_TP);
    const Correction correction = Solve(cell, point, q);
    if (correction.code == CorrectionCode::kSingular) continue;
    REQUIRE(correction.code == CorrectionCode::kOk);
    ++corrected;
    const Pose wanted = cell.robot.X_WB.Inverse() * point.X_WP;
    const Pose landed = Landed(cell, correction.X_BP_command, p_TP, q);
    CHECK((landed.p - wanted.p).norm() < 1e-6);
    CHECK(VectorFromRotation(landed.R * wanted.R.transpose()).norm() < 1e-6);
    CHECK((correction.translation_B - (correction.X_BP_command.p - wanted.p)).norm() < 1e-12);
    largest_m = std::max(largest_m, correction.translation_B.norm());
  }
  CHECK(corrected > 250);
  CHECK(largest_m > 5e-3);  // otherwise the arm is too stiff for this test
}

TEST_CASE("landing prediction matches the attained pose of an uncorrected command") {
  std::mt19937 random(21);
  const model::CellModel cell = test::HeavyArm();
  const model::JointVector q = test::RandomPosture(cell, random);
  const AssemblyPoint point = PointAt(cell, q);
  const Pose X_BP = cell.robot.X_WB.Inverse() * point.X_WP;
  Correction landing;
  Corrector(cell, {}).PredictLanding(X_BP, Vec3::Zero(), {60, *cell.payload_cog_F}, {}, q,
                                     BranchSearch::kNone, landing);
  REQUIRE(landing.code == CorrectionCode::kOk);
  const Pose landed = Landed(cell, X_BP, Vec3::Zero(), q);
  CHECK((landing.X_BP_command.p - landed.p).norm() < 1e-9);
}

TEST_CASE("every reason for refusal has its own code") {
  const model::CellModel cell = test::HeavyArm();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const AssemblyPoint good = PointAt(cell, q);
  REQUIRE(Solve(cell, good, q).code == CorrectionCode::kOk);

  SECTION("out of reach") {
    AssemblyPoint point = good;
    point.X_WP.p.x() += 10;
    CHECK(Solve(cell, point, q).code == CorrectionCode::kUnreachable);
    point.X_WP.p = Vec3(4.2, 0, 0.5);  // within the upper bound of the reach, but out of reach
    CHECK(Solve(cell, point, q).code == CorrectionCode::kUnreachable);
  }
  SECTION("joint limit") {
    model::CellModel narrow = cell;
    for (int i : {0, 1, 2, 4}) {  // no branch remains
      narrow.robot.joints[static_cast<std::size_t>(i)].min = q[i] + 0.1;
      narrow.robot.joints[static_cast<std::size_t>(i)].max = q[i] + 0.2;
    }
    CHECK(Solve(narrow, good, q).code == CorrectionCode::kJointLimit);
  }
  SECTION("singular posture") {
    model::JointVector straight = q;
    straight[4] = 0.005;
    CHECK(Solve(cell, PointAt(cell, straight), straight).code == CorrectionCode::kSingular);
  }
  SECTION("correction too large") {
    CorrectionLimits limits;
    limits.max_translation_m = 1e-3;
    CHECK(Solve(cell, good, q, limits).code == CorrectionCode::kTooLarge);
    limits = {};
    limits.max_rotation_rad = 1e-4;
    CHECK(Solve(cell, good, q, limits).code == CorrectionCode::kTooLarge);
  }
  SECTION("link masses not declared") {
    model::CellModel unknown = cell;
    unknown.robot.joints[2].link_mass_kg.reset();
    CHECK(Solve(unknown, good, q).code == CorrectionCode::kTorquesUnknown);
  }
}

TEST_CASE("with a free orientation only the position is matched") {
  const model::CellModel cell = test::HeavyArm();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  AssemblyPoint point = PointAt(cell, q);
  point.orientation_free = true;
  const Correction correction = Solve(cell, point, q);
  REQUIRE(correction.code == CorrectionCode::kOk);
  const Pose landed = Landed(cell, correction.X_BP_command, Vec3::Zero(), correction.q);
  CHECK((landed.p - (cell.robot.X_WB.Inverse() * point.X_WP).p).norm() < 1e-6);
}

TEST_CASE("a thermal effect without a temperature is extrapolated and widens the radius") {
  model::CellModel cell = test::HeavyArm();
  cell.measurement.reference_temperature_C = 20;
  model::WrittenEffect growth;
  growth.id = "thermal_growth";
  growth.parameters.emplace_back();
  growth.parameters.back().name = "alpha";
  growth.parameters.back().value = 1.2e-5;
  cell.effects = {growth};
  model::Domain domain;
  domain.q.assign(static_cast<std::size_t>(cell.robot.size()), model::Interval{-7, 7});
  domain.payload_kg = model::MeasuredRange{{{0, 80}}, {}};
  domain.temp_C = model::MeasuredRange{{{18, 30}}, {}};
  domain.residual_sigma_m = 5e-5;
  cell.domain = domain;
  CellCorrector corrector(cell, {});
  const model::JointVector q = model::JointVector::Constant(6, 0.3);
  const loads::Payload payload{60, *cell.payload_cog_F};
  const auto corrected = [&](std::optional<double> temp_C) {
    const effects::Conditions conditions = corrector.ConditionsOf(payload, 0, temp_C);
    Correction correction;
    corrector.solver().Correct(PointAt(cell, q), payload, conditions, q, BranchSearch::kBrief,
                               correction);
    REQUIRE(correction.code == CorrectionCode::kOk);
    corrector.StateRadius(payload, conditions, Vec3::Zero(), correction);
    return correction;
  };
  const Correction warm = corrected(25), unknown = corrected(std::nullopt);
  CHECK_FALSE(warm.extrapolated);
  CHECK(warm.basis == model::RadiusBasis::kMeasured);
  CHECK(unknown.extrapolated);
  CHECK(unknown.basis < model::RadiusBasis::kMeasured);
  // Ten kelvin above the reference temperature move the tip by about 0.2 mm.
  CHECK(unknown.uncertainty_m > std::hypot(warm.uncertainty_m, 1.5e-4));
}

}  // namespace plumbline::correct_test
