// The rod against closed forms: small loads, and the elastica in elliptic integrals.
#include "tests/virtual_cell/rod.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

namespace virtual_cell::rod_test {
namespace {

RodSegment UnitRod(double EI = 1) {
  return {.length_m = 1,
          .area_m2 = 1,
          .EI_x = EI,
          .EI_y = EI,
          .GJ = EI,
          .GA = 1e9,
          .EA = 1e9,
          .weight_kg_m = 0};
}

/// Tip slope of a cantilever under a dead tip load P L^2 / EI = load, from
///   sqrt(load) = K(k) - F(phi, k),  k^2 = (1 + sin theta) / 2,  sin phi = 1 / (k sqrt 2)
/// [Bisshopp & Drucker, Q. Appl. Math. 3 (1945) 272].
double ElasticaSlope(double load) {
  double low = 1e-9, high = std::numbers::pi / 2 - 1e-9;
  for (int i = 0; i < 200; ++i) {
    const double theta = (low + high) / 2;
    const double k = std::sqrt((1 + std::sin(theta)) / 2);
    const double phi = std::asin(1 / (k * std::numbers::sqrt2));
    const double root = std::comp_ellint_1(k) - std::ellint_1(k, phi);
    (root * root < load ? low : high) = theta;
  }
  return (low + high) / 2;
}

/// Tip deflection over length, 1 - 2 (E(k) - E(phi, k)) / sqrt(load).
double ElasticaDeflection(double load) {
  const double k = std::sqrt((1 + std::sin(ElasticaSlope(load))) / 2);
  const double phi = std::asin(1 / (k * std::numbers::sqrt2));
  return 1 - 2 * (std::comp_ellint_2(k) - std::ellint_2(k, phi)) / std::sqrt(load);
}

TEST_CASE("the closed form of the elastica agrees with the published table") {
  // Mattiasson, Int. J. Numer. Methods Eng. 17 (1981) 145, vertical tip displacement.
  CHECK(ElasticaDeflection(1) == Approx(0.30172).margin(1e-5));
  CHECK(ElasticaDeflection(2) == Approx(0.49346).margin(1e-5));
  CHECK(ElasticaDeflection(5) == Approx(0.71379).margin(1e-5));
  CHECK(ElasticaDeflection(10) == Approx(0.81061).margin(1e-5));
}

TEST_CASE("a tip force bends the rod like the elastica") {
  for (const double load : {0.1, 1.0, 2.0, 5.0, 10.0}) {
    CAPTURE(load);
    const RodShape shape = SolveRod({UnitRod()}, {.tip_force = {load, 0, 0}});
    REQUIRE(shape.converged);
    CHECK(shape.tip.translation().x() == Approx(ElasticaDeflection(load)).epsilon(1e-6));
    // The axial foreshortening: cos-free integral of the elastica, x = sqrt(2 sin theta / load).
    CHECK(shape.tip.translation().z() ==
          Approx(std::sqrt(2 * std::sin(ElasticaSlope(load)) / load)).epsilon(1e-6));
    CHECK(shape.tip.translation().y() == Approx(0).margin(1e-12));
    CHECK(VectorFromRotation(shape.tip.linear()).y() == Approx(ElasticaSlope(load)).epsilon(1e-6));
  }
}

TEST_CASE("small loads give the linear cantilever") {
  const RodSegment rod = UnitRod(1000);
  SECTION("tip force, F L^3 / 3EI, in both directions") {
    const RodShape shape = SolveRod({rod}, {.tip_force = {1e-2, -2e-2, 0}});
    CHECK(shape.tip.translation().x() == Approx(1e-2 / 3000).epsilon(1e-6));
    CHECK(shape.tip.translation().y() == Approx(-2e-2 / 3000).epsilon(1e-6));
  }
  SECTION("self-weight, w L^4 / 8EI") {
    RodSegment heavy = rod;
    heavy.weight_kg_m = 1e-2;
    const RodShape shape = SolveRod({heavy}, {.gravity = {1, 0, 0}});
    CHECK(shape.tip.translation().x() == Approx(1e-2 / 8000).epsilon(1e-6));
    CHECK(shape.root_moment.y() == Approx(1e-2 / 2).epsilon(1e-6));
  }
  SECTION("offset load, F L^3 / 3EI + F c L^2 / 2EI") {
    const RodShape shape = SolveRod({rod}, {.tip_force = {1e-2, 0, 0}, .tip_offset = {0, 0, 0.1}});
    CHECK(shape.tip.translation().x() == Approx(1e-2 / 3000 + 1e-3 / 2000).epsilon(1e-6));
  }
  SECTION("a load beside the axis twists, F c L / GJ") {
    const RodShape shape = SolveRod({rod}, {.tip_force = {1e-2, 0, 0}, .tip_offset = {0, 0.1, 0}});
    CHECK(VectorFromRotation(shape.tip.linear()).z() == Approx(-1e-3 / 1000).epsilon(1e-6));
  }
  SECTION("two segments, by superposition with the inner one's slope") {
    RodSegment inner = rod, outer = rod;
    inner.length_m = outer.length_m = 0.5;
    outer.EI_x = outer.EI_y = 500;
    const RodShape shape = SolveRod({inner, outer}, {.tip_force = {1e-2, 0, 0}});
    const double F = 1e-2, a = 0.5, EI = 1000;
    const double inner_sag = F * a * a * a / (3 * EI) + F * a * a * a / (2 * EI);
    const double slope = F * a * a / (2 * EI) + F * a * a / EI;
    CHECK(shape.tip.translation().x() ==
          Approx(inner_sag + slope * a + F * a * a * a / (3 * 500)).epsilon(1e-6));
  }
  SECTION("shear adds F L / kGA") {
    RodSegment soft = rod;
    soft.GA = 100;
    const RodShape shape = SolveRod({soft}, {.tip_force = {1e-2, 0, 0}}, {.shear_factor = 0.5});
    CHECK(shape.tip.translation().x() == Approx(1e-2 / 3000 + 1e-2 / 50).epsilon(1e-4));
  }
}

TEST_CASE("a heavy rod with an eccentric load: force balance, step size, frame invariance") {
  RodSegment heavy = UnitRod();
  heavy.weight_kg_m = 0.5;
  const RodLoad load{
      .gravity = {1, 0.4, -0.3}, .tip_force = {0.6, 0.2, -0.5}, .tip_offset = {0.1, 0.05, 0.2}};
  const RodShape shape = SolveRod({heavy}, load);
  REQUIRE(shape.converged);
  CHECK((shape.root_force - Vec3(1.1, 0.4, -0.65)).norm() < 1e-12);

  const RodShape fine = SolveRod({heavy}, load, {.steps = 400});
  CHECK((fine.tip.translation() - shape.tip.translation()).norm() < 1e-7);

  const Mat3 turn = RotationFromVector({0, 0, 0.7});
  const RodShape turned =
      SolveRod({heavy}, {turn * load.gravity, turn * load.tip_force, turn * load.tip_offset});
  CHECK((turned.tip.translation() - turn * shape.tip.translation()).norm() < 1e-9);
  CHECK((turned.root_moment - turn * shape.root_moment).norm() < 1e-9);
}

}  // namespace
}  // namespace virtual_cell::rod_test
