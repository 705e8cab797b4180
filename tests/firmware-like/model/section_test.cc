#include "firmware-like/model/section.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "firmware-like/model/materials.h"

namespace plumbline::section_test {

using namespace plumbline::model;

namespace {
constexpr double kMm2 = 1e-6, kMm4 = 1e-12;
}

TEST_CASE("sections match handbook areas and moments") {
  SECTION("circular hollow section 60.3 x 5, EN 10210-2: 8.69 cm2, 33.5 cm4") {
    const Section tube = TubeSection(0.0603, 0.005, 0.3);
    CHECK(tube.area_m2 / kMm2 == Approx(869).epsilon(0.001));
    CHECK(tube.ix_m4 / kMm4 == Approx(335e3).epsilon(0.001));
    CHECK(tube.iy_m4 == tube.ix_m4);
  }
  SECTION("square hollow section 60 x 4 with sharp corners, by hand") {
    const Section tube = SquareTubeSection(0.06, 0.004);
    CHECK(tube.area_m2 / kMm2 == Approx(60 * 60 - 52 * 52));
    CHECK(tube.ix_m4 / kMm4 == Approx((std::pow(60, 4) - std::pow(52, 4)) / 12));
  }
  SECTION(
      "IPE 200, EN 10365: 28.5 cm2, 1943 cm4, 142 cm4 including fillets, which the section omits") {
    const Section beam = IBeamSection(0.2, 0.1, 0.0056, 0.0085);
    CHECK(beam.area_m2 / kMm2 < 2850);
    CHECK(beam.area_m2 / kMm2 > 0.95 * 2850);
    CHECK(beam.ix_m4 / kMm4 < 1943e4);
    CHECK(beam.ix_m4 / kMm4 > 0.94 * 1943e4);
    CHECK(beam.iy_m4 / kMm4 == Approx(142e4).epsilon(0.01));
  }
  SECTION("rod and rectangle") {
    CHECK(RodSection(0.02, 0.3).ix_m4 == Approx(M_PI * std::pow(0.02, 4) / 64));
    CHECK(RodSection(0.02, 0.3).area_m2 == Approx(M_PI * 1e-4));
    const Section rectangle = RectangleSection(0.03, 0.05);
    CHECK(rectangle.ix_m4 == Approx(0.03 * std::pow(0.05, 3) / 12));
    CHECK(rectangle.iy_m4 == Approx(0.05 * std::pow(0.03, 3) / 12));
    CHECK(rectangle.reach_x_m == Approx(0.015));
  }
}

TEST_CASE("shear coefficients match Cowper's values and limits") {
  CHECK(RectangleSection(0.03, 0.05).shear_y == Approx(5.0 / 6));
  CHECK(RodSection(0.02, 0.3).shear_x == Approx(6 * 1.3 / (7 + 6 * 0.3)));
  const double thin_tube = 2 * 1.3 / (4 + 3 * 0.3);
  CHECK(TubeSection(0.1, 1e-5, 0.3).shear_x == Approx(thin_tube).epsilon(1e-3));
  CHECK(SquareTubeSection(0.1, 1e-5).shear_x == Approx(5.0 / 12).epsilon(1e-3));
  CHECK(SquareTubeSection(0.1, 0.05 - 1e-9).shear_x == Approx(5.0 / 6).epsilon(1e-6));
  // The web of an I-beam carries nearly all shear: A_web/A of an IPE 200 is 0.39.
  const double i_beam = IBeamSection(0.2, 0.1, 0.0056, 0.0085).shear_y;
  CHECK(i_beam > 0.36);
  CHECK(i_beam < 0.42);
  // An I-beam whose web fills its width is a rectangle.
  CHECK(IBeamSection(0.2, 0.1, 0.1 - 1e-9, 0.01).shear_y == Approx(5.0 / 6).epsilon(1e-6));
}

TEST_CASE("peak shear stress matches the handbook") {
  const double rectangle_m2 = 0.03 * 0.05;
  CHECK(1 / RectangleSection(0.03, 0.05).peak_shear_y_m2 == Approx(1.5 / rectangle_m2));
  CHECK(1 / RodSection(0.02, 0.3).peak_shear_x_m2 == Approx(4.0 / 3 / (M_PI * 1e-4)));
  const Section thin = TubeSection(0.1, 1e-5, 0.3);
  CHECK(thin.area_m2 / thin.peak_shear_x_m2 == Approx(2).epsilon(1e-3));
  CHECK(1 / IBeamSection(0.2, 0.1, 0.1 - 1e-9, 0.01).peak_shear_y_m2 ==
        Approx(1.5 / 0.02).epsilon(1e-6));
}

TEST_CASE("a section from published moments has no known outermost fibre") {
  const Section section = SectionFromMoments(1e-3, 2e-6, 1e-6);
  CHECK(section.reach_x_m == 0);
  CHECK(section.reach_y_m == 0);
  CHECK(section.ix_m4 == 2e-6);
}

TEST_CASE("materials are found by name and have plausible values and a source") {
  REQUIRE(MaterialByName("steel"));
  CHECK(MaterialByName("steel")->youngs_modulus_Pa == 210e9);
  CHECK(MaterialByName("steel")->ShearModulus() == Approx(80.77e9).epsilon(1e-4));
  CHECK_FALSE(MaterialByName("Steel"));
  CHECK_FALSE(MaterialByName(""));
  std::string previous;
  for (const model::NamedMaterial& named : model::NamedMaterials()) {
    CAPTURE(named.name);
    CHECK(previous < named.name);
    previous = named.name;
    CHECK(named.material.youngs_modulus_Pa > 1e9);
    CHECK(named.material.youngs_modulus_Pa < 500e9);
    CHECK(named.material.poisson_ratio > 0);
    CHECK(named.material.poisson_ratio < 0.5);
    CHECK(named.material.density_kg_m3 > 1000);
    CHECK_FALSE(named.source.empty());
  }
}

}  // namespace plumbline::section_test
