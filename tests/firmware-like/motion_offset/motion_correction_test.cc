#include "firmware-like/motion_offset/motion_correction.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "firmware-like/geometry/rotation.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::motion_correction_test {

using namespace plumbline::motion_offset;

namespace {

struct Cell {
  model::CellModel cell = test::HeavyArm();
  MotionModel model{7, correction::Corrector(cell, Limits())};
  CycleReport report;
  CorrectionRules rules;
  model::JointVector q{6};

  static correction::CorrectionLimits Limits() {
    correction::CorrectionLimits limits;
    limits.max_translation_m = 0.2;
    limits.max_rotation_rad = 0.3;
    return limits;
  }
  Cell() {
    q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
    report.now_s = report.q_s = 100;
    report.generation = 7;
    report.enabled = report.plc_alive = report.robot_trusted = true;
    report.q = q;
    report.payload = loads::Payload{20, *cell.payload_cog_F};
    report.radius = {0.0005, model::RadiusBasis::kMeasured};
  }
  MotionOffset::Order Order(const Offset& applied = {}) const {
    return OrderFor(report, &model, rules, q, applied, 100.01);
  }
  /// Error of the loaded tip if a joint solution of `X_BP` is commanded.
  Vec3 LoadedTip(const model::JointVector& commanded) const {
    deflection::LoadedState state;
    REQUIRE(model.corrector.arm().AtCommanded(commanded, *report.payload, {}, state));
    return state.X_BT.p;
  }
};

/// Joints near `q` whose unloaded tip is displaced by `offset_B`, the orientation unchanged: what a
/// controller does with an offset.
model::JointVector Displaced(const Cell& cell, const Vec3& offset_B) {
  const kinematics::Chain& chain = cell.model.corrector.arm().chain();
  Pose X_BP = cell.model.corrector.arm().UnloadedTip(cell.q);
  X_BP.p += offset_B;
  model::JointVector q = cell.q;
  const auto tip = [&](const model::JointVector& at, kinematics::Posture& posture) {
    chain.Evaluate(at, posture);
    return posture.X_BF() * cell.model.corrector.arm().X_FT(0);
  };
  REQUIRE(
      kinematics::SolvePose(chain, {X_BP, kinematics::Orientation::kFixed}, tip, 40, q).converged);
  return q;
}

}  // namespace

TEST_CASE("the offset brings the loaded tip to the programmed position, once it has settled") {
  std::mt19937 random(3);
  for (int k = 0; k < 20; ++k) {
    Cell cell;
    for (double& joint : cell.q) joint += std::uniform_real_distribution(-0.3, 0.3)(random);
    cell.report.q = cell.q;
    const Vec3 programmed = cell.model.corrector.arm().UnloadedTip(cell.q).p;
    const Vec3 uncorrected = cell.LoadedTip(cell.q) - programmed;
    const MotionOffset::Order first = cell.Order();
    REQUIRE(first.obstacle == Obstacle::kNone);
    Cell applied = cell;  // the packet's joints contain the offset
    applied.q = Displaced(cell, first.wanted.translation);
    applied.report.q = applied.q;
    const MotionOffset::Order settled = applied.Order(first.wanted);
    REQUIRE(settled.obstacle == Obstacle::kNone);
    CHECK((settled.wanted.translation - first.wanted.translation).norm() <
          1e-3 * uncorrected.norm() + 1e-9);
    const Vec3 left = cell.LoadedTip(applied.q) - programmed;
    CHECK(left.norm() < 0.02 * uncorrected.norm());
  }
}

TEST_CASE("the offset is expressed in the controller's frame") {
  Cell cell;
  const Vec3 in_base = cell.Order().wanted.translation;
  REQUIRE(in_base.norm() > 1e-3);
  cell.rules.R_frame = RotationFromRollPitchYaw({0.1, 0.2, 0.3});
  CHECK((cell.rules.R_frame * cell.Order().wanted.translation - in_base).norm() < 1e-12);
  cell.rules.frame = OffsetFrame::kTool;
  const Mat3 R_BT = cell.model.corrector.arm().UnloadedTip(cell.q).R;
  CHECK((R_BT * cell.rules.R_frame * cell.Order().wanted.translation - in_base).norm() < 1e-12);
}

TEST_CASE("the orientation is corrected only if asked") {
  Cell cell;
  CHECK(cell.Order().wanted.rotation.isZero(0));
  cell.rules.rotates = true;
  CHECK(cell.Order().wanted.rotation.norm() > 1e-4);
}

TEST_CASE("nothing is ordered without each of its conditions") {
  using Change = void (*)(Cell&);
  const std::pair<Obstacle, Change> cases[] = {
      {Obstacle::kNone, [](Cell&) {}},
      {Obstacle::kNoCycle, [](Cell& c) { c.report.now_s = 99.7; }},
      {Obstacle::kNoCycle, [](Cell& c) { c.report.generation = 6; }},
      {Obstacle::kNotEnabled, [](Cell& c) { c.report.enabled = false; }},
      {Obstacle::kHeartbeatLost, [](Cell& c) { c.report.plc_alive = false; }},
      {Obstacle::kRobotNotTrusted, [](Cell& c) { c.report.robot_trusted = false; }},
      {Obstacle::kNoJoints, [](Cell& c) { c.q.resize(0); }},
      {Obstacle::kNoJoints, [](Cell& c) { c.q.conservativeResize(5); }},
      {Obstacle::kNoJoints, [](Cell& c) { c.q[2] = std::nan(""); }},
      {Obstacle::kJointsDisagree, [](Cell& c) { c.q[1] = -c.q[1]; }},
      {Obstacle::kJointsDisagree, [](Cell& c) { c.q[1] += 0.1; }},
      {Obstacle::kNone,  // it moves since the reading
       [](Cell& c) { c.q[1] += 0.1, c.report.q_s = 99.97; }},
      {Obstacle::kNone, [](Cell& c) { c.report.q[5] += 2 * M_PI; }},
      {Obstacle::kCompensatedTwice, [](Cell& c) { c.report.compensated_twice = true; }},
      {Obstacle::kPayloadUnknown, [](Cell& c) { c.report.payload.reset(); }},
      {Obstacle::kBasisTooWeak,
       [](Cell& c) { c.report.radius.basis = model::RadiusBasis::kPropagated; }},
      {Obstacle::kBasisTooWeak, [](Cell& c) { c.report.radius.radius_m = 0; }},
      {Obstacle::kRadiusTooWide, [](Cell& c) { c.report.radius.radius_m = 0.0011; }},
      {Obstacle::kRefused,  // straight wrist
       [](Cell& c) { c.q[4] = c.report.q[4] = 0; }},
  };
  for (const auto& [obstacle, change] : cases) {
    Cell cell;
    change(cell);
    CAPTURE(Describe(obstacle));
    CHECK(cell.Order().obstacle == obstacle);
  }
  Cell cell;
  CHECK(OrderFor(cell.report, nullptr, cell.rules, cell.q, {}, 100).obstacle == Obstacle::kNoCycle);
}

TEST_CASE("after a lost heartbeat the permission must be cleared and set again") {
  MotionSwitch permission;
  CHECK_FALSE(permission.Update(false, false));
  CHECK(permission.Update(true, false));  // the heartbeat is an obstacle of its own
  CHECK(permission.Update(true, true));
  CHECK_FALSE(permission.Update(true, false));
  CHECK_FALSE(permission.Update(true, true));
  CHECK_FALSE(permission.Update(true, true));
  CHECK_FALSE(permission.Update(false, true));
  CHECK(permission.Update(true, true));
}

TEST_CASE("each obstacle has a description of its own") {
  for (int k = 1; k <= static_cast<int>(kLastObstacle); ++k) {
    CHECK(std::string(Describe(static_cast<Obstacle>(k))) != Describe(Obstacle::kNone));
  }
}

}  // namespace plumbline::motion_correction_test
