// What linear beam theory neglects, against the exact solution of the bent bar.
#include "firmware-like/deflection/linear_range.h"

#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

namespace plumbline::linear_range_test {

using namespace plumbline::deflection;

namespace {

/// Tip of a clamped bar of unit length under a force at its end that keeps its direction:
/// integrates
///   theta' = m,  m' = -(f_t cos theta - f_a sin theta)
/// with f = F L^2 / (E I) and finds the moment at the clamp that leaves none at the tip.
/// @return  displacement of the tip: transverse, and along the bar
Eigen::Vector2d ExactTip(double transverse, double axial) {
  constexpr int kSteps = 2000;
  constexpr double kStep = 1.0 / kSteps;
  Eigen::Vector2d tip;
  const auto end_moment = [&](double root_moment) {
    double theta = 0, moment = root_moment;
    tip.setZero();
    for (int step = 0; step < kSteps; ++step) {
      const auto slope = [&](double at) {
        return axial * std::sin(at) - transverse * std::cos(at);
      };
      const double middle = theta + kStep / 2 * moment;
      tip += kStep * Eigen::Vector2d(std::sin(middle), std::cos(middle));
      const double moment_mid = moment + kStep / 2 * slope(theta);
      theta += kStep * moment_mid;
      moment += kStep * slope(middle);
    }
    return moment;
  };
  double low = 0, high = 2 * transverse;
  for (int pass = 0; pass < 60; ++pass) {
    const double middle = (low + high) / 2;
    (end_moment(middle) < 0 ? low : high) = middle;
  }
  return tip - Eigen::Vector2d(0, 1);
}

/// HeavyArm with rigid joints and a weightless tool, held at an angle from the vertical.
struct Held {
  explicit Held(double deflection_share) : cell(test::HeavyArm()) {
    for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
    cell.tool.mount_mass_kg = 0;
    model::ToolSegment& segment = cell.tool.segments[0];
    segment.material.density_kg_m3 = 0;
    const double wanted = 100 * 9.80665 / (3 * segment.section.ix_m4 * deflection_share);
    segment.material.youngs_modulus_Pa = wanted;
    cell.payload_cog_F = Vec3(0, 0, 1);
  }
  LoadedState At(const LoadedArm& arm) const {
    LoadedState state;
    model::JointVector q = model::JointVector::Zero(6);
    q[4] = 0.7;
    REQUIRE(arm.AtCommanded(q, {100, *cell.payload_cog_F}, {}, state));
    return state;
  }
  model::CellModel cell;
};

}  // namespace

TEST_CASE("what linear beam theory neglects is bounded closely") {
  CHECK(ExactTip(1, 0).x() == Approx(0.3017).epsilon(1e-3));  // Bisshopp & Drucker, table for 1
  for (const double share : {0.02, 0.05, 0.1, 0.2}) {
    CAPTURE(share);
    const Held held(share);
    const LoadedArm arm(held.cell);
    const LoadedState state = held.At(arm);
    const Vec3& g_F = state.tool.g_F;
    const double stiffness = 3 * share / 9.80665;  // F L^2 / (E I) per m/s^2 of gravity
    const double across = stiffness * g_F.head<2>().norm(), along = stiffness * g_F.z();
    const Eigen::Vector2d exact = ExactTip(across, along);
    const double linear = state.bend_F.norm();
    CHECK(linear == Approx(across / 3).epsilon(1e-6));
    const double neglected = (exact - Eigen::Vector2d(linear, 0)).norm();
    const double stated = NeglectedByLinearTheory(arm, state);
    CHECK(stated >= neglected);
    CHECK(stated < 3 * neglected);
    CHECK(BendShare(arm, state) == Approx(linear));
  }
  model::CellModel rigid = test::HeavyArm();
  rigid.tool.rigid = true;
  rigid.tool.segments.clear();
  const LoadedArm arm(rigid);
  CHECK(NeglectedByLinearTheory(arm, Held(0.1).At(arm)) == 0);
}

TEST_CASE("the largest bending stress is compared with the yield strength, if there is one") {
  Held held(0.05);
  const LoadedArm arm(held.cell);
  const LoadedState state = held.At(arm);
  CHECK_FALSE(YieldShare(held.cell.tool, state));
  model::ToolSegment& segment = held.cell.tool.segments[0];
  segment.material.yield_strength_Pa = 100e6;
  const Vec3 force = 100 * state.tool.g_F;
  const double normal_Pa = (std::abs(force.x()) + std::abs(force.y())) * segment.section.reach_x_m /
                           segment.section.ix_m4;
  CHECK(*YieldShare(held.cell.tool, state) == Approx(normal_Pa / 100e6).epsilon(0.05));
}

}  // namespace plumbline::linear_range_test
