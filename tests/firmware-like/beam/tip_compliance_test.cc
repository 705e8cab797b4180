#include "firmware-like/beam/tip_compliance.h"

#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/beam/beam.h"
#include "tests/firmware-like/beam/beams.h"

namespace plumbline::tip_compliance_test {

using namespace plumbline::beam;
using namespace plumbline::test;

namespace {

Vec3 RandomVector(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> value(-size, size);
  return {value(random), value(random), value(random)};
}

}  // namespace

TEST_CASE("the tip of a uniform tool matches docs/reference/files.md to 1e-12") {
  const model::Tool tool = UniformTool();
  const TipCompliance compliance = TipComplianceOf(tool);
  const double l = 0.9, e = 210e9;
  const double iy = 0.05 * std::pow(0.03, 3) / 12;
  const double ix = 0.03 * std::pow(0.05, 3) / 12;
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3 f = RandomVector(random, 1000), m = RandomVector(random, 200);
    const Vec3 g = RandomVector(random, 10), w = 7850 * 0.03 * 0.05 * g;
    const Vec6 bend = compliance.Bend(f, m, g);
    const double dx = f.x() * l * l * l / (3 * e * iy) + m.y() * l * l / (2 * e * iy) +
                      w.x() * l * l * l * l / (8 * e * iy);
    const double dy = f.y() * l * l * l / (3 * e * ix) - m.x() * l * l / (2 * e * ix) +
                      w.y() * l * l * l * l / (8 * e * ix);
    const double size = std::hypot(dx, dy);
    CHECK(std::abs(bend[0] - dx) <= 1e-12 * size);
    CHECK(std::abs(bend[1] - dy) <= 1e-12 * size);
    CHECK(bend[2] == 0);
    CHECK(bend[5] == 0);
  }
}

TEST_CASE("the compliance matrix agrees with the finite elements for random loads") {
  const model::BeamTheory theory =
      GENERATE(model::BeamTheory::kEulerBernoulli, model::BeamTheory::kTimoshenko);
  const model::Tool tool = SteppedTool(theory);
  const TipCompliance compliance = TipComplianceOf(tool, GENERATE(1, 6));
  const Beam beam(tool, 4);
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3 f = RandomVector(random, 1000), m = RandomVector(random, 200);
    const Vec3 g = RandomVector(random, 10);
    const SectionState tip = beam.Solve({.points = {{beam.Length(), f, m}}, .g_F = g}).Tip();
    const Vec6 bend = compliance.Bend(f, m, g);
    CHECK((bend.head<3>() - tip.d_F).norm() <= 1e-10 * tip.d_F.norm());
    CHECK((bend.tail<3>() - tip.r_F).norm() <= 1e-10 * tip.r_F.norm());
  }
}

TEST_CASE("the compliance is symmetric and passive") {
  const TipCompliance compliance = TipComplianceOf(SteppedTool(model::BeamTheory::kTimoshenko));
  const auto& c = compliance.C_wrench;
  CHECK((c - c.transpose()).norm() <= 1e-12 * c.norm());
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    Vec6 wrench;
    wrench << RandomVector(random, 100), RandomVector(random, 100);
    CHECK(wrench.dot(c * wrench) >= 0);
  }
}

TEST_CASE("a rigid tool does not bend") {
  model::Tool rigid;
  rigid.tcp_F = Vec3(0.1, 0, 0.3);
  const TipCompliance compliance = TipComplianceOf(rigid);
  CHECK(compliance.Bend(Vec3(1e3, 1e3, 1e3), Vec3(1e3, 1e3, 1e3), Vec3(9, 9, 9)).norm() == 0);
}

TEST_CASE("the mount's mass does not bend the tool") {
  model::Tool tool = UniformTool();
  const TipCompliance without = TipComplianceOf(tool);
  tool.mount_mass_kg = 50;
  CHECK(TipComplianceOf(tool).C_gravity == without.C_gravity);
}

}  // namespace plumbline::tip_compliance_test
