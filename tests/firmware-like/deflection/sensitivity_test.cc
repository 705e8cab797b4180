#include "firmware-like/deflection/sensitivity.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::sensitivity_test {

using namespace plumbline::deflection;
using I = effects::Influence<double>;

namespace {

/// A step that moves the tip by about 0.1 mm.
double StepOf(int entry) {
  const int kind = entry / model::kMaxJoints;
  if (entry < I::kFirst) {
    constexpr double kSteps[] = {1e-5, 1e-8, 1e-15, 1e-6, 1e-8, 1e-1, 1e-5, 1e-5,
                                 1e-5, 1e-5, 1e-8,  1e-8, 1e-8, 1e-5, 1e-5};
    return kSteps[kind];
  }
  switch (entry) {
    case I::kPayloadMass:
      return 1e-2;
    case I::kBendRatio:
    case I::kShear:
      return 1e-4;
    case I::kRootCompliance:
    case I::kPedestalCompliance:
      return 1e-9;
    default:
      return 1e-5;
  }
}

Mat3 TurnAt(const LoadedArm& arm, const model::JointVector& q, const loads::Payload& payload,
            const effects::Influence<double>& influence) {
  LoadedStateOf<double> state;
  REQUIRE(arm.AtCommanded(q, payload, &influence, {}, state));
  return state.X_WT.R;
}

Vec3 PointAt(const LoadedArm& arm, const model::JointVector& q, const loads::Payload& payload,
             const effects::Influence<double>& influence) {
  LoadedStateOf<double> state;
  REQUIRE(arm.AtCommanded(q, payload, &influence, {}, state));
  return state.p_read_W;
}

/// Every kind of influence is nonzero, so that derivatives are not only taken at zero.
effects::Influence<double> SomeInfluence() {
  effects::Influence<double> at;
  at.Joint(I::kCompliance, 1) = 2e-7;
  at.Joint(I::kTorque, 1) = 300;
  at.Joint(I::kHardening, 1) = 1e-15;
  at.Joint(I::kLengthA, 2) = 1e-3;
  at[I::kRootCompliance] = 1e-7;
  at[I::kPedestalCompliance] = 1e-8;
  at[I::kBendRatio] = -0.2;
  at[I::kBase] = 1e-3;
  at[I::kScale] = 1e-4;
  at[I::kCameraScale] = 2e-3;
  at[I::kCameraDepth] = -1e-3;
  at[I::kCameraRadial] = 0.02;
  at.Joint(I::kBearing, 1) = 1e-8;
  at.Joint(I::kGuideTiltX, 2) = 2e-5;
  at.Joint(I::kGuideTiltY, 2) = 3e-5;
  at.Joint(I::kLinkBending, 2) = 2e-8;
  at.Joint(I::kLinkTorsion, 2) = 3e-8;
  at[I::kBaseTilt] = 2e-6;  // its closed-form derivative is first order
  return at;
}

}  // namespace

TEST_CASE("gradients of tip position and rotation match central differences") {
  model::CellModel cell = test::HeavyArm();
  cell.robot.X_WB.R = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  cell.robot.X_WB.p = Vec3(0.1, -0.2, 0.3);
  enum Instrument { kOfPositions, kCamera, kOfRanges };
  const auto instrument = GENERATE(kOfPositions, kCamera, kOfRanges);
  if (instrument == kOfRanges) cell.measurement.kind = model::MeasurementKind::kRange;
  if (instrument == kCamera) {  // beside the arm, looking at it
    cell.measurement.X_WC = Pose{RotationFromRollPitchYaw(Vec3(-1.5, 0.1, 0.2)), Vec3(0.3, -6, 1)};
  }
  if (GENERATE(false, true)) {  // an arm with a prismatic joint
    model::Joint& slide = cell.robot.joints[2];
    slide.type = model::JointType::kPrismatic;
    slide.min = 0.2;
    slide.max = 0.8;
  }
  const auto drive = GENERATE(model::CouplingDrive::kAxis, model::CouplingDrive::kReading);
  if (GENERATE(false, true)) cell.robot.couplings = {{2, 1, 0.8, drive}, {4, 3, -0.3, drive}};
  const LoadedArm arm(cell);
  std::mt19937 random(7);
  for (int trial = 0; trial < 5; ++trial) {
    const model::JointVector q = test::RandomPosture(cell, random);
    const loads::Payload payload{40.0 * trial, *cell.payload_cog_F};
    const effects::Influence<double> at =
        trial > 2 ? SomeInfluence() : effects::Influence<double>();
    Sensitivity sensitivity;
    REQUIRE(SensitivityAt(arm, q, payload, at, {}, InfluenceSet{}.set(), sensitivity, true));
    CHECK((sensitivity.p_W - PointAt(arm, q, payload, at)).norm() < 1e-13);
    for (int entry = 0; entry < I::kSize; ++entry) {
      if (entry < I::kFirst && entry % model::kMaxJoints >= arm.size()) {
        CHECK(sensitivity.dp.col(entry).norm() == 0);
        CHECK(sensitivity.dr.col(entry).norm() == 0);
        continue;
      }
      const double step = StepOf(entry);
      effects::Influence<double> more = at, less = at;
      more[entry] += step;
      less[entry] -= step;
      const Vec3 difference =
          (PointAt(arm, q, payload, more) - PointAt(arm, q, payload, less)) / (2 * step);
      CAPTURE(trial, entry, difference.transpose(), sensitivity.dp.col(entry).transpose());
      const double scale = difference.norm() + 1e-9 / step;
      CHECK((difference - sensitivity.dp.col(entry)).norm() < 1e-5 * scale);
      const Vec3 turn = VectorFromRotation(TurnAt(arm, q, payload, more) *
                                           TurnAt(arm, q, payload, less).transpose()) /
                        (2 * step);
      CAPTURE(turn.transpose(), sensitivity.dr.col(entry).transpose());
      CHECK((turn - sensitivity.dr.col(entry)).norm() < 1e-5 * (turn.norm() + 1e-9 / step));
    }
  }
}

TEST_CASE("the gradient for a subset of entries equals that part of the full gradient") {
  const model::CellModel cell = test::HeavyArm();
  const LoadedArm arm(cell);
  std::mt19937 random(8);
  const model::JointVector q = test::RandomPosture(cell, random);
  const loads::Payload payload{60, *cell.payload_cog_F};
  effects::Influence<double> at;
  at.Joint(I::kCompliance, 1) = 2e-7;
  Sensitivity all;
  REQUIRE(SensitivityAt(arm, q, payload, at, {}, all));
  for (const int entry : {I::kCompliance * model::kMaxJoints + 1,
                          I::kLengthA * model::kMaxJoints + 2, static_cast<int>(I::kPayloadMass)}) {
    InfluenceSet wanted;
    wanted.set(static_cast<std::size_t>(entry));
    Sensitivity one;
    REQUIRE(SensitivityAt(arm, q, payload, at, {}, wanted, one));
    const double size = all.dp.col(entry).norm();
    CHECK(size > 0);
    CHECK((one.dp.col(entry) - all.dp.col(entry)).norm() < 1e-12 * size);
  }
}

TEST_CASE("a joint whose load balances between both sides of a gap stays within the gap") {
  model::CellModel cell;
  cell.robot.joints = {test::MakeJoint(1.0, 0, 0, 0, -180, 180, 10, {-0.5, 0, 0}, 1e-4)};
  cell.robot.g_W = Vec3(0, -9.81, 0);
  cell.payload_cog_F = Vec3::Zero();
  const LoadedArm arm(cell);
  effects::Influence<double> influence;
  influence.Joint(I::kLoadGap, 0) = 1e-3;
  model::JointVector q(1);
  q << 1.5707963267948966;  // upright: the torque changes sign within the gap
  LoadedStateOf<double> state;
  REQUIRE(arm.AtCommanded(q, {}, &influence, {}, state));
  CHECK(std::abs(state.sag[0]) < 2e-3);
}

TEST_CASE("the covariance due to effects matches that of sampled parameters") {
  model::CellModel cell = test::HeavyArm();
  model::WrittenEffect effect;
  effect.id = "joint_compliance";
  effect.scope = {"q2", "q3"};
  effect.parameters.resize(2);
  effect.parameters[0].name = "q2";
  effect.parameters[1].name = "q3";
  effect.parameters[0].value = 2e-7;
  effect.parameters[1].value = 3e-7;
  effect.covariance.resize(2, 2);
  effect.covariance << 4e-18, -1e-18, -1e-18, 9e-18;
  cell.effects = {effect};
  std::mt19937 random(3);
  const model::JointVector q = test::RandomPosture(cell, random);
  const loads::Payload payload{60, *cell.payload_cog_F};
  const Mat3 propagated = EffectCovariance(LoadedArm(cell), q, payload, {});
  const Eigen::Matrix2d root = effect.covariance.topLeftCorner<2, 2>().llt().matrixL();
  std::normal_distribution<double> normal;
  LoadedState state;
  REQUIRE(LoadedArm(cell).AtCommanded(q, payload, {}, state));
  const Vec3 middle = state.X_WT.p;
  Mat3 drawn = Mat3::Zero();
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Vector2d off = root * Eigen::Vector2d(normal(random), normal(random));
    model::CellModel other = cell;
    for (int k = 0; k < 2; ++k) {
      other.effects[0].parameters[static_cast<std::size_t>(k)].value += off[k];
    }
    REQUIRE(LoadedArm(other).AtCommanded(q, payload, {}, state));
    drawn += (state.X_WT.p - middle) * (state.X_WT.p - middle).transpose() / kDraws;
  }
  CHECK((propagated - drawn).norm() < 0.1 * drawn.norm());
}

}  // namespace plumbline::sensitivity_test
