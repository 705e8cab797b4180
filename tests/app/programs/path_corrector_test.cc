// A dense path, corrected row by row.
#include "app/programs/correction/path_corrector.h"

#include <catch2/catch.hpp>

#include "firmware-like/geometry/rotation.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::path_corrector_test {

using namespace plumbline::programs;

namespace {

const model::CellModel kCell = test::HeavyArm();
const loads::Payload kLoad{60, *kCell.payload_cog_F};

model::JointVector PostureAt(double share) {
  model::JointVector q(6);
  q << 0.3 + 0.4 * share, 0.2, -0.3, 0.5 - 0.3 * share, 0.9, 0.2;
  return q;
}

}  // namespace

TEST_CASE("a path of poses is corrected as single points are") {
  const correction::Corrector single(kCell, {});
  PathCorrector path(kCell, {}, {.near_q = PostureAt(0)});
  for (int k = 0; k <= 200; ++k) {
    const model::JointVector q = PostureAt(k / 200.0);
    const Pose X_BT = single.arm().UnloadedTip(q);
    CorrectedRow row;
    path.Correct({.q = {}, .X_BT = X_BT, .payload = kLoad, .temp_C = {}, .t_s = {}}, row);
    REQUIRE(row.problem.empty());
    correction::Correction expected;
    correction::AssemblyPoint point;
    point.X_WP = kCell.robot.X_WB * X_BT;
    single.Correct(point, kLoad, {}, q, correction::BranchSearch::kNone, expected);
    CHECK((row.correction.q - expected.q).norm() < 1e-7);
    CHECK((row.X_BT_command.p - expected.X_BP_command.p).norm() < 1e-8);
    CHECK(row.correction.uncertainty_m > 0);
  }
}

TEST_CASE("joints and poses of a path have the same corrections") {
  PathCorrector by_joints(kCell, {}, {}), by_poses(kCell, {}, {});
  for (int k = 0; k <= 20; ++k) {
    const model::JointVector q = PostureAt(k / 20.0);
    CorrectedRow one, other;
    by_joints.Correct({.q = q, .X_BT = {}, .payload = kLoad, .temp_C = {}, .t_s = {}}, one);
    by_poses.Correct(
        {.q = q, .X_BT = by_poses.arm().UnloadedTip(q), .payload = kLoad, .temp_C = {}, .t_s = {}},
        other);
    REQUIRE(one.problem.empty());
    CHECK((one.correction.q - other.correction.q).norm() < 1e-8);
  }
}

TEST_CASE("the radius follows the load and the posture") {
  PathCorrector path(kCell, {}, {});
  correction::CellCorrector exact(kCell, {});
  for (const double mass_kg : {0.0, 60.0, 20.0}) {
    const loads::Payload load{mass_kg, *kCell.payload_cog_F};
    for (int k = 0; k <= 50; ++k) {
      CorrectedRow row;
      path.Correct({.q = PostureAt(k / 50.0), .X_BT = {}, .payload = load, .temp_C = {}, .t_s = {}},
                   row);
      REQUIRE(row.problem.empty());
      correction::Correction whole = row.correction;
      exact.StateRadius(load, exact.ConditionsOf(load, 0, {}), Vec3::Zero(), whole);
      CHECK(row.correction.uncertainty_m == Approx(whole.uncertainty_m).epsilon(0.05));
    }
  }
}

TEST_CASE("a pose whose posture cannot be known needs joints") {
  PathCorrector path(kCell, {}, {});
  CorrectedRow row;
  path.Correct({.q = {},
                .X_BT = path.arm().UnloadedTip(PostureAt(0)),
                .payload = kLoad,
                .temp_C = {},
                .t_s = {}},
               row);
  CHECK_FALSE(row.problem.empty());
}

TEST_CASE("a jump of the path is followed by a search, and an unreachable row is skipped") {
  PathCorrector path(kCell, {}, {.near_q = PostureAt(0)});
  CorrectedRow row;
  const auto correct = [&](const Pose& X_BT) {
    path.Correct({.q = {}, .X_BT = X_BT, .payload = kLoad, .temp_C = {}, .t_s = {}}, row);
  };
  correct(path.arm().UnloadedTip(PostureAt(0)));
  REQUIRE(row.problem.empty());
  correct({Mat3::Identity(), Vec3(9, 0, 0)});
  CHECK_FALSE(row.problem.empty());
  correct(path.arm().UnloadedTip(PostureAt(1)));
  CHECK(row.problem.empty());
}

}  // namespace plumbline::path_corrector_test
