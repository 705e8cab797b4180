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

namespace {

/// The heavy arm without its last axis: it cannot turn the tool about its own axis.
model::CellModel WithoutRoll() {
  model::CellModel cell = test::HeavyArm();
  cell.robot.joints.pop_back();
  return cell;
}

/// Base, shoulder, elbow, pitch and roll of the tool, as small five-axis arms have.
model::CellModel PitchAndRoll() {
  model::CellModel cell = test::HeavyArm();
  cell.robot.joints[2].a_m = 1.2;
  cell.robot.joints[2].alpha_rad = 0;
  cell.robot.joints.erase(cell.robot.joints.begin() + 3);
  return cell;
}

/// Two upright axes, a spindle and a fourth upright axis.
model::CellModel Scara() {
  model::CellModel cell = test::HeavyArm();
  const auto row = [](double a_m, double d_m, double mass_kg, double compliance) {
    return test::MakeJoint(a_m, 0, d_m, 0, -150, 150, mass_kg, {-a_m / 2, 0, 0}, compliance);
  };
  cell.robot.joints = {row(0.4, 0.5, 10, 2e-6), row(0.3, 0, 6, 4e-6), row(0, 0, 2, 0),
                       row(0, 0, 1, 5e-6)};
  cell.robot.joints[1].alpha_rad = std::numbers::pi;
  cell.robot.joints[2].type = model::JointType::kPrismatic;
  cell.robot.joints[2].compliance_rad_per_Nm.reset();
  cell.robot.joints[2].min = 0;
  cell.robot.joints[2].max = 0.3;
  // A base that leans turns a SCARA's weight about its axes.
  cell.robot.X_WB.R = Eigen::AngleAxisd(0.02, Vec3::UnitX()).toRotationMatrix();
  cell.tool.segments.front().length_m = 0.3;
  cell.tool.tcp_F = Vec3(0, 0, 0.3);
  cell.payload_cog_F = Vec3(0.1, 0, 0.3);
  return cell;
}

/// Where the loaded tool point is at the corrected command.
Pose Attained(const model::CellModel& cell, const Correction& correction, const Vec3& p_TP,
              double payload_kg) {
  const deflection::LoadedArm arm(cell);
  deflection::LoadedState state;
  REQUIRE(arm.AtCommanded(correction.q, {payload_kg, *cell.payload_cog_F}, {}, state));
  return cell.robot.X_WB * Pose{state.X_BT.R, state.X_BT * p_TP};
}

}  // namespace

TEST_CASE("each arm is asked for the orientations that it can take") {
  using kinematics::Orientation;
  const auto of = [](const model::CellModel& cell) { return Corrector(cell, {}).orientation(); };
  CHECK(of(test::HeavyArm()) == Orientation::kFixed);
  CHECK(of(WithoutRoll()) == Orientation::kAxis);
  CHECK(of(PitchAndRoll()) == Orientation::kNearest);
  CHECK(of(Scara()) == Orientation::kNearest);
  // A column below a SCARA does what its spindle does; a rail beside a five-axis arm lets it take
  // every orientation.
  model::Joint rail;
  rail.type = model::JointType::kPrismatic;
  rail.min = -2;
  rail.max = 2;
  model::CellModel cell = Scara();
  cell.robot.joints.insert(cell.robot.joints.begin(), rail);
  CHECK(of(cell) == Orientation::kNearest);
  cell = PitchAndRoll();
  rail.alpha_rad = 0.5 * std::numbers::pi;
  cell.robot.joints.insert(cell.robot.joints.begin(), rail);
  CHECK(of(cell) == Orientation::kFixed);
}

TEST_CASE("an arm without roll is corrected in position and direction of the tool's axis") {
  std::mt19937 random(23);
  const model::CellModel cell = WithoutRoll();
  const Vec3 p_TP(0.02, -0.1, 0.05);
  int corrected = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    AssemblyPoint point = PointAt(cell, q, p_TP);
    // Turned about the tool's axis by an angle that the arm cannot reach there.
    const double turn = trial % 2 == 0 ? 0 : 0.5;
    point.X_WP.R = point.X_WP.R * Eigen::AngleAxisd(turn, Vec3::UnitZ()).toRotationMatrix();
    const Correction correction = Solve(cell, point, q, {0.05, 0.2, 0.02, {}});
    if (correction.code == CorrectionCode::kSingular) continue;
    CAPTURE(trial, Describe(correction.code));
    REQUIRE(correction.code == CorrectionCode::kOk);
    ++corrected;
    const Pose attained = Attained(cell, correction, p_TP, 60);
    CHECK((attained.p - point.X_WP.p).norm() < 1e-6);
    CHECK(attained.R.col(2).cross(point.X_WP.R.col(2)).norm() < 1e-6);
    const double left = VectorFromRotation(point.X_WP.R * attained.R.transpose()).norm();
    CHECK(correction.residual_rad == Approx(left).margin(1e-8));
    if (turn > 0) CHECK(left > 0.1);
    CHECK(correction.rotation_B.norm() < 0.2);
  }
  CHECK(corrected > 80);
}

TEST_CASE("an arm with pitch and roll comes as near to the orientation as it can") {
  std::mt19937 random(26);
  const model::CellModel cell = PitchAndRoll();
  int corrected = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const AssemblyPoint point = PointAt(cell, q);
    const Correction correction = Solve(cell, point, q, {0.2, 0.2, 0.02, {}});
    if (correction.code != CorrectionCode::kOk) continue;
    ++corrected;
    const Pose attained = Attained(cell, correction, Vec3::Zero(), 60);
    CHECK((attained.p - point.X_WP.p).norm() < 1e-6);
    // No joint motion that leaves the tip there comes nearer.
    const deflection::LoadedArm arm(cell);
    kinematics::Posture posture;
    kinematics::Jacobian jacobian;
    arm.chain().Evaluate(correction.q, posture);
    arm.chain().JacobianAt(posture, posture.X_BF() * arm.X_FT().p, jacobian);
    const Eigen::MatrixXd in_place = Eigen::MatrixXd(jacobian.topRows<3>()).fullPivLu().kernel();
    const Vec3 left_B =
        cell.robot.X_WB.R.transpose() * VectorFromRotation(point.X_WP.R * attained.R.transpose());
    const Eigen::VectorXd gain = (jacobian.bottomRows<3>() * in_place).transpose() * left_B;
    CHECK(gain.norm() < 0.05 * left_B.norm() + 1e-6);
    CHECK(correction.residual_rad == Approx(left_B.norm()).margin(1e-8));
  }
  CHECK(corrected > 40);
}

TEST_CASE("a SCARA is corrected in position, and its turn about the vertical") {
  std::mt19937 random(24);
  const model::CellModel cell = Scara();
  int corrected = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    AssemblyPoint point = PointAt(cell, q);
    const Correction correction = Solve(cell, point, q, {}, 5);
    if (correction.code != CorrectionCode::kOk) continue;
    ++corrected;
    const Pose attained = Attained(cell, correction, Vec3::Zero(), 5);
    CHECK((attained.p - point.X_WP.p).norm() < 1e-6);
    const Vec3 left_T =
        attained.R.transpose() * VectorFromRotation(point.X_WP.R * attained.R.transpose());
    CHECK(std::abs(left_T.z()) < 1e-5);     // reached
    CHECK(left_T.head<2>().norm() > 1e-6);  // the bending tool tilts; the arm cannot
    CHECK(correction.residual_rad == Approx(left_T.norm()).margin(1e-8));
    // A target that is tilted much farther is out of reach, and that is said.
    point.X_WP.R = point.X_WP.R * Eigen::AngleAxisd(0.4, Vec3::UnitX()).toRotationMatrix();
    const Correction tilted = Solve(cell, point, q, {}, 5);
    CHECK(tilted.code == CorrectionCode::kUnreachable);
    CHECK(tilted.residual_rad > 0.3);
    point.orientation_free = true;
    CHECK(Solve(cell, point, q, {}, 5).code == CorrectionCode::kOk);
  }
  CHECK(corrected > 70);
}

TEST_CASE("of two branches, an arm of four axes takes the one with the nearer orientation") {
  model::CellModel cell = test::HeavyArm();
  const auto& heavy = test::HeavyArm().robot.joints;
  model::Joint forearm = heavy[2], pitch = heavy[4];
  forearm.a_m = 1.2;
  forearm.alpha_rad = 0;
  pitch.a_m = 0.2;
  pitch.alpha_rad = 0.5 * std::numbers::pi;
  cell.robot.joints = {heavy[0], heavy[1], forearm, pitch};
  for (model::Joint& joint : cell.robot.joints) {
    joint.min = -std::numbers::pi;
    joint.max = std::numbers::pi;
  }
  const model::JointVector seed = model::JointVector::Zero(4);
  int corrected = 0;
  for (const double azimuth_deg : {170.0, -165.0, 150.0}) {
    const model::JointVector q = Eigen::Vector4d(azimuth_deg * test::kDegree, 0.5, 0.6, -0.4);
    const Correction correction = Solve(cell, PointAt(cell, q), seed, {0.3, 0.2, 0.0, {}});
    CAPTURE(azimuth_deg, Describe(correction.code), correction.residual_rad);
    if (correction.code == CorrectionCode::kOk) ++corrected;
    CHECK(correction.residual_rad < 0.1);
    // A predicted landing states the same angle and has the same limit.
    const Pose X_BP = cell.robot.X_WB.Inverse() * PointAt(cell, q).X_WP;
    Correction landing;
    Corrector(cell, {0.3, 0.2, 0.0, {}})
        .PredictLanding(X_BP, Vec3::Zero(), {60, *cell.payload_cog_F}, {}, seed,
                        BranchSearch::kBrief, landing);
    CHECK(landing.code == CorrectionCode::kOk);
    CHECK(landing.residual_rad < 1e-6);
  }
  CHECK(corrected == 3);
}

TEST_CASE("a seven-axis arm keeps the posture in which it was taught") {
  std::mt19937 random(25);
  model::CellModel cell = test::HeavyArm();
  cell.robot.joints.insert(cell.robot.joints.begin() + 2,
                           test::MakeJoint(0, 90, 0, 0, -150, 150, 40, {0, 0, 0.1}, 5e-7));
  int corrected = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const Correction correction = Solve(cell, PointAt(cell, q), q, {0.05, 0.2, 0.02, {}});
    if (correction.code != CorrectionCode::kOk) continue;
    ++corrected;
    CHECK((correction.q - q).cwiseAbs().maxCoeff() < 0.2);
  }
  CHECK(corrected > 40);
}

}  // namespace plumbline::correct_test
