#include "firmware-like/beam/beam.h"

#include <catch2/catch.hpp>
#include <random>

#include "tests/firmware-like/beam/beams.h"

namespace plumbline::beam_test {

using namespace plumbline::beam;
using namespace plumbline::test;

namespace {

/// Relative agreement, with a floor for values that should be zero.
void CheckClose(const Vec3& got, const Vec3& expected, double relative, double floor = 1e-15) {
  CAPTURE(got.transpose(), expected.transpose());
  CHECK((got - expected).norm() <= relative * expected.norm() + floor);
}

BeamLoads AllKinds(double length_m) {
  BeamLoads loads;
  loads.points = {{length_m, Vec3(120, -80, 30), Vec3(4, -9, 2)},
                  {0.37 * length_m, Vec3(-55, 210, 0), Vec3(-3, 7, 0)},
                  {0.5 * length_m, Vec3(10, 20, 0), Vec3::Zero()}};
  loads.masses = {{4.5, length_m, Vec3(0.02, -0.03, length_m + 0.1)},
                  {1.5, 0.61 * length_m, Vec3(-0.01, 0.04, 0.61 * length_m)}};
  loads.g_F = Vec3(3, -8, 4);
  loads.acceleration_F = Vec3(1.5, 0.7, -2);
  loads.angular_acceleration_F = Vec3(2, -3, 0.5);
  return loads;
}

}  // namespace

TEST_CASE("a uniform cantilever matches the closed forms in both planes") {
  const model::Tool tool = UniformTool();
  const double l = 0.9;
  const double ei_x = 210e9 * tool.segments[0].section.iy_m4;
  const double ei_y = 210e9 * tool.segments[0].section.ix_m4;
  const int elements = GENERATE(1, 2, 7, 40);
  CAPTURE(elements);
  const Beam beam(tool, elements);
  BeamLoads loads;

  SECTION("tip force") {
    loads.points = {{l, Vec3(100, -70, 0), Vec3::Zero()}};
    const SectionState tip = beam.Solve(loads).Tip();
    CheckClose(tip.d_F, Vec3(100 * l * l * l / (3 * ei_x), -70 * l * l * l / (3 * ei_y), 0), 1e-9);
    CheckClose(tip.r_F, Vec3(70 * l * l / (2 * ei_y), 100 * l * l / (2 * ei_x), 0), 1e-9);
  }
  SECTION("tip moment") {
    loads.points = {{l, Vec3::Zero(), Vec3(11, 13, 0)}};
    const SectionState tip = beam.Solve(loads).Tip();
    CheckClose(tip.d_F, Vec3(13 * l * l / (2 * ei_x), -11 * l * l / (2 * ei_y), 0), 1e-9);
    CheckClose(tip.r_F, Vec3(11 * l / ei_y, 13 * l / ei_x, 0), 1e-9);
  }
  SECTION("self-weight") {
    loads.g_F = Vec3(2, -9, 5);
    const double m = 7850 * tool.segments[0].section.area_m2;
    const SectionState tip = beam.Solve(loads).Tip();
    const double l4 = l * l * l * l;
    CheckClose(tip.d_F, Vec3(2 * m * l4 / (8 * ei_x), -9 * m * l4 / (8 * ei_y), 0), 1e-9);
    CheckClose(tip.r_F, Vec3(9 * m * l * l * l / (6 * ei_y), 2 * m * l * l * l / (6 * ei_x), 0),
               1e-9);
  }
  SECTION("angular acceleration: a load growing along z, w = -m alpha z") {
    loads.angular_acceleration_F = Vec3(0, 6, 0);
    const double w1 = -6 * 7850 * tool.segments[0].section.area_m2;
    const SectionState tip = beam.Solve(loads).Tip();
    CheckClose(tip.d_F, Vec3(11 * w1 * std::pow(l, 5) / (120 * ei_x), 0, 0), 1e-9);
  }
  SECTION("a force anywhere: a^2 (3 L - a) F / (6 EI)") {
    const double a = GENERATE(0.05, 0.3, 0.45, 0.777);
    loads.points = {{a, Vec3(100, 0, 0), Vec3::Zero()}};
    const BeamSolution solution = beam.Solve(loads);
    CheckClose(solution.Tip().d_F, Vec3(100 * a * a * (3 * l - a) / (6 * ei_x), 0, 0), 1e-9);
    CheckClose(solution.At(a).d_F, Vec3(100 * a * a * a / (3 * ei_x), 0, 0), 1e-9);
  }
}

TEST_CASE("a Timoshenko cantilever adds shear deflection") {
  const model::Tool tool = UniformTool(model::BeamTheory::kTimoshenko);
  const model::Section& section = tool.segments[0].section;
  const double l = 0.9;
  const double gka = kSteel.ShearModulus() * section.area_m2 * 5 / 6;
  const int elements = GENERATE(1, 3, 20);
  const Beam beam(tool, elements);
  SECTION("tip force: F L / (kappa G A), the section's rotation unchanged") {
    const SectionState tip = beam.Solve({.points = {{l, Vec3(0, 500, 0), Vec3::Zero()}}}).Tip();
    const double ei = 210e9 * section.ix_m4;
    CheckClose(tip.d_F, Vec3(0, 500 * l * l * l / (3 * ei) + 500 * l / gka, 0), 1e-9);
    CheckClose(tip.r_F, Vec3(-500 * l * l / (2 * ei), 0, 0), 1e-9);
  }
  SECTION("self-weight: w L^2 / (2 kappa G A)") {
    const SectionState tip = beam.Solve({.g_F = Vec3(10, 0, 0)}).Tip();
    const double w = 7850 * section.area_m2 * 10;
    const double ei = 210e9 * section.iy_m4;
    CheckClose(tip.d_F, Vec3(w * l * l * l * l / (8 * ei) + w * l * l / (2 * gka), 0, 0), 1e-9);
  }
}

TEST_CASE("a stepped cantilever agrees with Castigliano's theorem") {
  // d = F (L^3 - b^3) / (3 EI1) + F b^3 / (3 EI2), b the outer segment's length.
  const double l1 = 0.5, l2 = 0.3, force_N = 200;
  const model::Tool tool = BeamTool({{l1, model::RectangleSection(0.06, 0.06), kSteel},
                                     {l2, model::RectangleSection(0.04, 0.04), kAluminium}});
  const double ei1 = 210e9 * std::pow(0.06, 4) / 12;
  const double ei2 = 70e9 * std::pow(0.04, 4) / 12;
  const double l = l1 + l2;
  const double expected =
      force_N * (l * l * l - l2 * l2 * l2) / (3 * ei1) + force_N * l2 * l2 * l2 / (3 * ei2);
  for (const auto& counts : std::vector<std::vector<int>>{{1, 1}, {3, 1}, {2, 5}, {30, 20}}) {
    const BeamSolution solution =
        Beam(tool, counts).Solve({.points = {{l, Vec3(force_N, 0, 0), Vec3::Zero()}}});
    CHECK(solution.node_count() == counts[0] + counts[1] + 1);
    CHECK(solution.Tip().d_F.x() == Approx(expected).epsilon(1e-9));
  }
}

TEST_CASE("results do not depend on the number of elements, for every kind of load") {
  const model::BeamTheory theory =
      GENERATE(model::BeamTheory::kEulerBernoulli, model::BeamTheory::kTimoshenko);
  const model::Tool tool = SteppedTool(theory);
  const BeamLoads loads = AllKinds(tool.Length());
  const BeamSolution coarse = Beam(tool, 1).Solve(loads);
  const int elements = GENERATE(2, 5, 16, 100);
  CAPTURE(elements);
  const BeamSolution fine = Beam(tool, elements).Solve(loads);
  const double tolerance = 1e-9;
  for (int i = 0; i <= 50; ++i) {
    const double z_m = tool.Length() * i / 50;
    CAPTURE(z_m);
    const SectionState a = coarse.At(z_m), b = fine.At(z_m);
    CheckClose(b.d_F, a.d_F, 0, tolerance * coarse.Tip().d_F.norm());
    CheckClose(b.r_F, a.r_F, 0, tolerance * coarse.Tip().r_F.norm());
    CheckClose(b.force_F, a.force_F, 0, tolerance * coarse.Node(0).force_F.norm());
    CheckClose(b.moment_F, a.moment_F, 0, tolerance * coarse.Node(0).moment_F.norm());
  }
}

TEST_CASE("loads superpose") {
  const model::Tool tool = SteppedTool(model::BeamTheory::kTimoshenko);
  const Beam beam(tool, 3);
  BeamLoads all = AllKinds(tool.Length());
  all.masses.clear();
  BeamLoads points = all, field = all;
  points.g_F = points.acceleration_F = points.angular_acceleration_F = Vec3::Zero();
  field.points.clear();
  const BeamSolution a = beam.Solve(points), b = beam.Solve(field), sum = beam.Solve(all);
  for (int node = 0; node < sum.node_count(); ++node) {
    CheckClose(sum.Node(node).d_F, a.Node(node).d_F + b.Node(node).d_F, 1e-12);
    CheckClose(sum.Node(node).moment_F, a.Node(node).moment_F + b.Node(node).moment_F, 1e-9, 1e-9);
  }
}

TEST_CASE("an acceleration acts like opposite gravity on the beam and its payload") {
  const Beam beam(SteppedTool(), 4);
  BeamLoads falling, hanging;
  falling.masses = hanging.masses = {{5, beam.Length(), Vec3(0.1, 0, beam.Length() + 0.2)}};
  falling.acceleration_F = Vec3(1, -2, 3);
  hanging.g_F = Vec3(-1, 2, -3);
  CheckClose(beam.Solve(falling).Tip().d_F, beam.Solve(hanging).Tip().d_F, 1e-14);
  SECTION("there is no bending in free fall") {
    hanging.acceleration_F = hanging.g_F;
    CheckClose(beam.Solve(hanging).Tip().d_F, Vec3::Zero(), 0);
  }
  SECTION("angular acceleration loads a point mass by alpha x p") {
    BeamLoads turning, forced;
    model::Tool massless = SteppedTool();
    for (model::ToolSegment& segment : massless.segments) segment.material.density_kg_m3 = 0;
    const Beam light(massless, 2);
    const double z_m = light.Length();
    turning.masses = {{5, z_m, Vec3(0, 0, z_m)}};
    turning.angular_acceleration_F = Vec3(3, 0, 0);
    forced.points = {{z_m, Vec3(0, 5 * 3 * z_m, 0), Vec3::Zero()}};
    CheckClose(light.Solve(turning).Tip().d_F, light.Solve(forced).Tip().d_F, 1e-13);
  }
}

TEST_CASE("a payload bends the beam by its force and by its moment, also a force along z") {
  const Beam beam(UniformTool(), 2);
  const double l = beam.Length();
  BeamLoads loads;
  loads.masses = {{10, l, Vec3(0.2, 0, l + 0.1)}};
  loads.g_F = Vec3(0, 0, -9.8);
  // The weight along -z with an arm of 0.2 m along x turns the tip about y by +10*9.8*0.2 N m.
  const double ei = 210e9 * 0.05 * std::pow(0.03, 3) / 12;
  CheckClose(beam.Solve(loads).Tip().d_F, Vec3(19.6 * l * l / (2 * ei), 0, 0), 1e-10);
}

TEST_CASE("internal forces balance the loads outboard") {
  const model::Tool tool =
      SteppedTool(GENERATE(model::BeamTheory::kEulerBernoulli, model::BeamTheory::kTimoshenko));
  const BeamLoads loads = AllKinds(tool.Length());
  const BeamSolution solution = Beam(tool, 7).Solve(loads);
  // Compare with statics: a sum over thin slices outboard of z.
  const double z_m = GENERATE(0.0, 0.2, 0.45, 0.8);
  Vec3 force_F = Vec3::Zero(), moment_F = Vec3::Zero();
  auto add = [&](const Vec3& at, const Vec3& force, const Vec3& moment) {
    force_F += force;
    moment_F += (at - Vec3(0, 0, z_m)).cross(force) + moment;
  };
  for (const PointLoad& p : loads.points) {
    if (p.z_m >= z_m) add(Vec3(0, 0, p.z_m), p.force_F, p.moment_F);
  }
  auto pull = [&](const Vec3& at) -> Vec3 {
    return loads.g_F - loads.acceleration_F - loads.angular_acceleration_F.cross(at);
  };
  for (const PointMass& m : loads.masses) {
    if (m.z_m >= z_m) add(m.cog_F, m.mass_kg * pull(m.cog_F), Vec3::Zero());
  }
  double root_m = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    constexpr int kSlices = 4000;
    for (int i = 0; i < kSlices; ++i) {
      const Vec3 at(0, 0, root_m + segment.length_m * (i + 0.5) / kSlices);
      const double mass_kg =
          segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m / kSlices;
      if (at.z() > z_m) add(at, mass_kg * pull(at), Vec3::Zero());
    }
    root_m += segment.length_m;
  }
  force_F.z() = moment_F.z() = 0;
  const SectionState section = solution.At(z_m);
  CheckClose(section.force_F, force_F, 1e-4);
  CheckClose(section.moment_F, moment_F, 1e-4);
}

TEST_CASE("between nodes of a slender beam, the slope is the derivative of the displacement") {
  const model::Tool tool = SteppedTool();
  const BeamSolution solution = Beam(tool, 2).Solve(AllKinds(tool.Length()));
  for (const double z_m : {0.11, 0.33, 0.5, 0.68, 0.9}) {
    const double h = 1e-5;
    const Vec3 slope = (solution.At(z_m + h).d_F - solution.At(z_m - h).d_F) / (2 * h);
    const Vec3 r = solution.At(z_m).r_F;
    CheckClose(Vec3(r.y(), -r.x(), 0), slope, 1e-6);
  }
}

TEST_CASE("a load at the root acts on the clamp only") {
  const Beam beam(UniformTool(), 3);
  const BeamSolution solution = beam.Solve({.points = {{0, Vec3(1000, 1000, 0), Vec3(50, 0, 0)}}});
  CheckClose(solution.Tip().d_F, Vec3::Zero(), 0);
}

}  // namespace plumbline::beam_test
