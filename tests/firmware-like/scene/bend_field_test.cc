#include "firmware-like/scene/bend_field.h"

#include <catch2/catch.hpp>
#include <cmath>

namespace plumbline::bend_field_test {

using namespace plumbline::scene;

namespace {

/// d_x = z^3 with r_y = 3 z^2: a cubic, which the field reproduces exactly between stations.
BendField CubicField(double length_m, int moved, double off_m) {
  BendField field;
  field.length_m = static_cast<float>(length_m);
  field.stations[static_cast<std::size_t>(moved)].off_m = static_cast<float>(off_m);
  for (int i = 0; i < kBendStations; ++i) {
    const double z = field.StationZ(i);
    field.stations[static_cast<std::size_t>(i)].d_F = Vec3(z * z * z, 0, 0).cast<float>();
    field.stations[static_cast<std::size_t>(i)].r_F = Vec3(0, 3 * z * z, 0).cast<float>();
  }
  return field;
}

}  // namespace

TEST_CASE("a cubic displacement is reproduced between stations, also with moved stations") {
  for (const double off_m : {0.0, 0.011, -0.011}) {
    const BendField field = CubicField(0.8, 12, off_m);
    for (int k = 0; k < 216; ++k) {
      const double z = 0.0004 + 0.0037 * k;
      CAPTURE(off_m, z);
      CHECK(BentPoint(field, Vec3(0, 0, z)).x() == Approx(z * z * z).margin(1e-7));
    }
  }
}

TEST_CASE("no motion inboard of the flange; beyond the tip the last section continues rigidly") {
  const BendField field = CubicField(0.8, 1, 0);
  const Vec3 inboard(0.1, 0.2, -0.3);
  CHECK(BentPoint(field, inboard) == inboard);
  const Vec3 beyond(0.1, 0.2, 0.9);
  const Vec3 r(0, 3 * 0.8 * 0.8, 0);
  const Vec3 expected = beyond + Vec3(0.8 * 0.8 * 0.8, 0, 0) + r.cross(Vec3(0.1, 0.2, 0.1));
  CHECK((BentPoint(field, beyond) - expected).norm() < 1e-6);
  CHECK(BentPoint(BendField{}, beyond) == beyond);
}

}  // namespace plumbline::bend_field_test
