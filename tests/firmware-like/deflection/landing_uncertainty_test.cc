#include "firmware-like/deflection/landing_uncertainty.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

using namespace plumbline;

namespace {

/// A heavy arm whose compliances were identified, with what the fit left.
CellModel Identified() {
  CellModel cell = test::HeavyArm();
  WrittenEffect effect;
  effect.id = "joint_compliance";
  effect.scope = {"q2", "q3"};
  effect.parameters = {{"q2", 2e-7, std::nullopt, "rad/(N m)", ""},
                       {"q3", 3e-7, std::nullopt, "rad/(N m)", ""}};
  effect.covariance.resize(2, 2);
  effect.covariance << 4e-16, -1e-16, -1e-16, 9e-16;
  cell.effects = {effect};
  cell.domain.emplace();
  for (const Joint& joint : cell.robot.joints) cell.domain->q.push_back({joint.min, joint.max});
  cell.domain->residual_sigma_m = 5e-5;
  return cell;
}

double Radius(const CellModel& cell, const JointVector& q, double declared_m, bool extrapolated) {
  const LoadedArm arm(cell);
  return LandingUncertainty(cell, arm).Radius95_m(arm, q, {60, *cell.payload_cog_F}, {}, declared_m,
                                                  extrapolated);
}

}  // namespace

TEST_CASE("the radius of an identified model holds 95 % of the arms it may be") {
  const CellModel cell = Identified();
  std::mt19937 random(31);
  const JointVector q = test::RandomPosture(cell, random);
  const double radius_m = Radius(cell, q, 1, false);
  const Eigen::Matrix2d root = cell.effects[0].covariance.topLeftCorner<2, 2>().llt().matrixL();
  std::normal_distribution<double> normal;
  const Payload payload{60, *cell.payload_cog_F};
  LoadedState state;
  REQUIRE(LoadedArm(cell).AtCommanded(q, payload, {}, state));
  const Vec3 middle = state.X_WT.p;
  constexpr int kDraws = 3000;
  int within = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Vector2d off = root * Eigen::Vector2d(normal(random), normal(random));
    CellModel other = cell;
    for (int k = 0; k < 2; ++k) {
      other.effects[0].parameters[static_cast<std::size_t>(k)].value += off[k];
    }
    REQUIRE(LoadedArm(other).AtCommanded(q, payload, {}, state));
    const Vec3 rest = 5e-5 * Vec3(normal(random), normal(random), normal(random));
    within += (state.X_WT.p + rest - middle).norm() <= radius_m ? 1 : 0;
  }
  CHECK(within > 0.93 * kDraws);  // two deviations of the count are 0.8 %
  CHECK(within < 0.97 * kDraws);
}

TEST_CASE("what was not seen counts as declared, and a declared model has its share alone") {
  CellModel cell = Identified();
  std::mt19937 random(32);
  const JointVector q = test::RandomPosture(cell, random);
  const double inside_m = Radius(cell, q, 2e-3, false);
  CHECK(Radius(cell, q, 2e-3, true) == Approx(std::hypot(inside_m, 2e-3)));
  cell.domain->residual_sigma_m.reset();
  cell.measurement.sigma_m = 5e-5;
  CHECK(Radius(cell, q, 2e-3, false) == Approx(inside_m));
  cell.domain.reset();
  CHECK(Radius(cell, q, 2e-3, false) == 2e-3);
}
