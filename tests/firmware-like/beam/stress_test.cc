#include <catch2/catch.hpp>

#include "firmware-like/beam/beam.h"
#include "tests/firmware-like/beam/beams.h"

namespace plumbline::stress_test {

using namespace plumbline::beam;
using namespace plumbline::test;

TEST_CASE(
    "a tip force causes the largest stress at the root: sigma = 6 F L / (b h^2), tau = 1.5 F / A") {
  const BeamSolution solution =
      Beam(UniformTool(), 4).Solve({.points = {{0.9, Vec3(0, 300, 0), Vec3::Zero()}}});
  const LargestStress largest = LargestStressOf(solution);
  REQUIRE(largest.peak);
  CHECK(largest.complete);
  CHECK(largest.element == 0);
  CHECK(largest.peak->z_m == 0);
  const double normal = 6 * 300 * 0.9 / (0.03 * 0.05 * 0.05);
  const double shear = 1.5 * 300 / (0.03 * 0.05);
  CHECK(largest.peak->stress.normal_Pa == Approx(normal));
  CHECK(largest.peak->stress.shear_Pa == Approx(shear));
  CHECK(largest.peak->stress.von_mises_Pa ==
        Approx(std::sqrt(normal * normal + 3 * shear * shear)));
}

TEST_CASE("moments about both axes add up in a corner, and as squares in a round section") {
  SectionState state;
  state.moment_F = Vec3(30, 40, 0);
  const model::Section rectangle = model::RectangleSection(0.03, 0.05);
  CHECK(StressOf(rectangle, state)->normal_Pa ==
        Approx(40 * 0.015 / rectangle.iy_m4 + 30 * 0.025 / rectangle.ix_m4));
  const model::Section rod = model::RodSection(0.04, 0.3);
  CHECK(StressOf(rod, state)->normal_Pa == Approx(50 * 0.02 / rod.ix_m4));
}

TEST_CASE("the largest stress is in the thin outer segment if that is weaker") {
  const model::Tool tool = BeamTool({{0.5, model::RectangleSection(0.1, 0.1), kSteel},
                                     {0.5, model::RectangleSection(0.01, 0.01), kSteel}});
  const BeamSolution solution =
      Beam(tool, 2).Solve({.points = {{1.0, Vec3(5, 0, 0), Vec3::Zero()}}});
  const LargestStress largest = LargestStressOf(solution);
  CHECK(largest.element == 2);
  CHECK(largest.peak->z_m == Approx(0.5));
}

TEST_CASE("a peak inside an element is found") {
  // A tip force opposing the self-weight: M'(z) = 0 at w (L - z) = F.
  const model::Tool tool = UniformTool();
  const double w = 7850 * 0.03 * 0.05 * 10;
  const double force_N = 0.7 * w * 0.9;  // the moment at the root is small, the shear zero at 0.27
  const BeamSolution solution = Beam(tool, 1).Solve(
      {.points = {{0.9, Vec3(0, -force_N, 0), Vec3::Zero()}}, .g_F = Vec3(0, 10, 0)});
  const ElementStress element = StressInElement(solution, 0);
  CHECK(element.largest_moment.z_m == Approx(0.27));
  CHECK(std::abs(element.largest_moment.force_F.y()) < 1e-9);
  CHECK(element.largest_moment.moment_F.norm() == Approx(force_N * 0.63 - w * 0.63 * 0.63 / 2));

  SECTION("also at a load between nodes") {
    const BeamSolution pair = Beam(tool, 1).Solve(
        {.points = {{0.61, Vec3(0, 100, 0), Vec3::Zero()}, {0.9, Vec3(0, -100, 0), Vec3::Zero()}}});
    CHECK(StressInElement(pair, 0).largest_moment.moment_F.norm() == Approx(100 * 0.29));
    CHECK(StressInElement(pair, 0).largest_shear.z_m > 0.61);
  }
}

TEST_CASE("stress is unknown if the outermost fibre is unknown") {
  const model::ToolSegment bare{0.4, model::SectionFromMoments(1e-3, 1e-6, 1e-6), kSteel};
  const model::ToolSegment rod{0.4, model::RodSection(0.03, 0.3), kSteel};
  const BeamLoads loads{.points = {{0.4, Vec3(100, 0, 0), Vec3::Zero()}}};
  const LargestStress none = LargestStressOf(Beam(BeamTool({bare}), 2).Solve(loads));
  CHECK_FALSE(none.peak);
  CHECK_FALSE(none.complete);
  const BeamSolution half = Beam(BeamTool({bare, rod}), 1).Solve(loads);
  CHECK(LargestStressOf(half).peak);
  CHECK_FALSE(LargestStressOf(half).complete);
  CHECK_FALSE(StressInElement(half, 0).peak);
  CHECK(StressInElement(half, 0).largest_moment.moment_F.norm() == Approx(40));
}

}  // namespace plumbline::stress_test
