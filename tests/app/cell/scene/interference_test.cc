// Distances and depths of known geometry in random poses; bent meshes against meshes built bent.
#include "app/cell/scene/interference.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "app/cell/scene/mesh_pair.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/cell/scene/shapes.h"

namespace plumbline::interference_test {

using namespace plumbline::cell;
using test::Cuboid;
using test::Sphere;

namespace {

scene::CheckedMesh Checked(const scene::TriangleMesh& mesh) {
  auto checked = scene::CheckMesh(mesh, 1);
  REQUIRE(checked);
  return std::move(checked).value();
}

Pose AnyPose(std::mt19937& random) {
  std::uniform_real_distribution<double> in(-1, 1);
  const Vec3 rpy(3 * in(random), 1.5 * in(random), 3 * in(random));
  return {RotationFromRollPitchYaw(rpy), Vec3(in(random), in(random), in(random))};
}

/// Bending of a one-metre tool: parabolic, 0.02 m at the tip, with a small rotation.
scene::BendField Hanging() {
  scene::BendField field;
  field.length_m = 1;
  for (std::size_t i = 0; i < field.stations.size(); ++i) {
    const float z = static_cast<float>(i) / (scene::kBendStations - 1);
    field.stations[i].d_F = {0.02F * z * z, 0.005F * z * z, 0};
    field.stations[i].r_F = {-0.01F * z, 0.04F * z, 0.01F * z};
  }
  return field;
}

/// The mesh with all its vertices bent.
scene::TriangleMesh Bent(scene::TriangleMesh mesh, const scene::BendField& field,
                         const Pose& X_FO) {
  for (Vec3f& p : mesh.vertices_O) {
    p = scene::BentPoint(field, X_FO * Vec3(p.cast<double>())).cast<float>();
  }
  return mesh;
}

/// Two shells in one mesh, the second one shifted.
scene::TriangleMesh Together(scene::TriangleMesh one, const scene::TriangleMesh& other,
                             const Vec3f& by) {
  const auto before = static_cast<std::uint32_t>(one.vertices_O.size());
  for (const Vec3f& p : other.vertices_O) one.vertices_O.emplace_back(p + by);
  for (const scene::Triangle& t : other.triangles) {
    one.triangles.push_back({t[0] + before, t[1] + before, t[2] + before});
  }
  return one;
}

scene::TriangleMesh TurnedOver(scene::TriangleMesh mesh) {
  for (scene::Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

}  // namespace

TEST_CASE("the exit of intersecting triangles agrees with trial positions") {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> in(-1, 1);
  const auto any = [&] { return Vec3(in(random), in(random), in(random)); };
  int crossing = 0;
  for (int i = 0; i < 3000; ++i) {
    Corners a = {any(), any(), any()}, b = {any(), any(), any()};
    Vec3 way = any();
    if (i % 10 == 0) {  // coplanar, moved within the plane
      for (Corners* const one : {&a, &b}) {
        for (Vec3& p : *one) p.z() = 0.5;
      }
      way.z() = 0;
    }
    way.normalize();
    const bool cross = TrianglesCross(a, b);
    CHECK(TrianglesCross(b, a) == cross);
    if (!cross) continue;
    ++crossing;
    const TriangleExit exit = ExitOf(a, b, way);
    const auto moved = [&](double by_m) {
      return TrianglesCross({a[0] + by_m * way, a[1] + by_m * way, a[2] + by_m * way}, b);
    };
    CHECK((exit.way_m < 1e-9 || moved(exit.way_m - 1e-9)));
    CHECK_FALSE(moved(exit.way_m + 1e-9));
    CHECK(exit.normal.dot(way) > 0);
  }
  CHECK(crossing > 300);
  // The triangles intersect along a segment with known ends.
  const Corners flat = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  const Corners upright = {Vec3(0.2, 0.2, -1), Vec3(0.4, 0.2, -1), Vec3(0.3, 0.2, 1)};
  REQUIRE(MiddleOfCrossing(flat, upright));
  CHECK(MiddleOfCrossing(flat, upright)->isApprox(Vec3(0.3, 0.2, 0), 1e-12));
  CHECK_FALSE(MiddleOfCrossing(flat, flat));
}

TEST_CASE("two spheres: distance, nearest points, and depth along the line of centres") {
  // All vertices are on the sphere; in between the surface is less than 0.15 mm inside it.
  constexpr double kSag_m = 1.5e-4;
  const scene::CheckedMesh mesh = Checked(Sphere(0.2F, 90, 180));
  std::mt19937 random(3);
  for (const double gap_m : {0.3, 0.02, 0.001, -0.001, -0.02, -0.1}) {
    Interference scene;
    const std::size_t a = scene.Add(mesh, {}, 1, false), b = scene.Add(mesh, {}, 0.5, false);
    const Pose X_Wa = AnyPose(random), X_Wb = AnyPose(random);
    const Vec3 way = (X_Wb.p - X_Wa.p).normalized();
    scene.Place(a, X_Wa);
    scene.Place(b, {X_Wb.R, X_Wa.p + (0.3 + gap_m) * way});
    const Separation found = scene.Measure(a, b);
    INFO("gap " << gap_m);
    CHECK(found.touching == (gap_m < 0));
    CHECK_FALSE(found.inside);
    if (gap_m > 0) {
      CHECK(found.distance_m >= gap_m - 1e-7);
      CHECK(found.distance_m <= gap_m + 2 * kSag_m);
      CHECK((found.p_b_W - found.p_a_W).norm() == Approx(found.distance_m).margin(1e-6));
      CHECK((found.p_a_W - X_Wa.p).norm() == Approx(0.2).margin(kSag_m));
      CHECK(found.depth_m == 0);
    } else {
      CHECK(found.distance_m == 0);
      CHECK(found.depth_m <= -gap_m + Interference::kDepthStep_m + 1e-7);
      CHECK(found.depth_m >= -gap_m - 3 * kSag_m - 0.02 * -gap_m);
      CHECK(found.penetration_direction_W.dot(-way) > 0.99);
      CHECK((found.p_a_W - X_Wa.p).cross(way).norm() < 0.01);
    }
    CHECK(scene.Measure(b, a).distance_m == Approx(found.distance_m).margin(1e-9));
    CHECK(scene.Measure(b, a).depth_m == Approx(found.depth_m).margin(1e-4));
  }
}

TEST_CASE("a peg above a plate, in it, and through its edge") {
  const scene::CheckedMesh plate = Checked(Cuboid({1, 1, 0.2F})),
                           peg = Checked(Cuboid({0.1F, 0.1F, 0.4F}));
  std::mt19937 random(5);
  for (int pose = 0; pose < 20; ++pose) {
    Interference scene;
    const std::size_t a = scene.Add(peg, {}, 1, false), b = scene.Add(plate, {}, 1, false);
    const Pose X_WP = AnyPose(random);
    scene.Place(b, X_WP);
    const auto measure = [&](double x, double y, double z) {
      scene.Place(a, X_WP * Pose{Mat3::Identity(), Vec3(x, y, z)});
      return scene.Measure(a, b);
    };
    const Separation over = measure(0.1, 0.2, 0.3 + 0.015);
    CHECK(over.distance_m == Approx(0.015).margin(1e-6));
    CHECK_FALSE(over.touching);
    const Separation in = measure(0.1, 0.2, 0.3 - 0.015);
    CHECK(in.touching);
    CHECK(in.depth_m == Approx(0.015).margin(2 * Interference::kDepthStep_m));
    CHECK(in.penetration_direction_W.dot(X_WP.R.col(2)) == Approx(1).margin(1e-3));
    const Separation aside = measure(0.5 + 0.05 - 0.007, 0.1, 0.123);
    CHECK(aside.depth_m == Approx(0.007).margin(2 * Interference::kDepthStep_m));
    CHECK(aside.penetration_direction_W.dot(X_WP.R.col(0)) == Approx(1).margin(1e-3));
  }
}

TEST_CASE("an object entirely inside another is interference, except in an open shell") {
  Interference scene;
  const std::size_t inner = scene.Add(Checked(Sphere(0.05F, 12, 24)), {}, 1, false);
  const std::size_t outer = scene.Add(Checked(Cuboid({1, 1, 1})), {}, 1, false);
  scene::TriangleMesh open = Cuboid({1, 1, 1});
  open.triangles.pop_back();
  const std::size_t shell = scene.Add(Checked(open), {}, 1, false);
  scene.Place(inner, {Mat3::Identity(), Vec3(0.3, 0.05, 0.1)});
  const Separation found = scene.Measure(inner, outer);
  CHECK(found.touching);
  CHECK(found.inside);
  CHECK(found.distance_m == 0);
  CHECK(found.depth_m == Approx(0.25).margin(1e-3));
  CHECK(found.penetration_direction_W.x() == Approx(1).margin(0.01));
  CHECK(scene.Measure(outer, inner).inside);
  CHECK_FALSE(scene.Measure(inner, shell).touching);
  // To the edge of the missing triangle, y + z = 0 in the plane x = 0.5.
  CHECK(scene.Measure(inner, shell).distance_m ==
        Approx(std::sqrt(0.04 + 0.01125) - 0.05).margin(1e-3));
}

TEST_CASE("several shells in one mesh: overlaps are inside, a cavity is not") {
  const scene::TriangleMesh large = Cuboid({1, 1, 1}), small = Cuboid({0.5F, 0.5F, 0.5F});
  const auto holds = [](const scene::TriangleMesh& shells, const Vec3& p_W) {
    Interference scene;
    const std::size_t ball = scene.Add(Checked(Sphere(0.02F, 12, 24)), {}, 1, false);
    const std::size_t body = scene.Add(Checked(shells), {}, 1, false);
    scene.Place(ball, {Mat3::Identity(), p_W});
    return scene.Measure(ball, body).inside;
  };
  const Vec3 in_both(0.35, 0.1, 0.05), in_large(-0.3, 0.1, 0.05), in_small(0.65, 0.1, 0.05);
  const Vec3f beside(0.5F, 0, 0);
  const scene::TriangleMesh overlapping = Together(large, small, beside);
  for (const scene::TriangleMesh& shells : {overlapping, TurnedOver(overlapping)}) {
    CHECK(holds(shells, in_both));
    CHECK(holds(shells, in_large));
    CHECK(holds(shells, in_small));
    CHECK_FALSE(holds(shells, {0.9, 0.1, 0.05}));
  }
  const Vec3 middle(0.01, 0.02, 0.03);
  CHECK(holds(Together(large, small, Vec3f::Zero()), middle));  // one body inside another
  const scene::TriangleMesh hollow = Together(large, TurnedOver(small), Vec3f::Zero());
  CHECK_FALSE(holds(hollow, middle));
  CHECK(holds(hollow, {0.4, 0.02, 0.03}));
  // One reversed triangle: parity decides instead of the winding number.
  scene::TriangleMesh torn = hollow;
  std::swap(torn.triangles[0][1], torn.triangles[0][2]);
  CHECK_FALSE(holds(torn, middle));
  CHECK(holds(torn, {0.4, 0.02, 0.03}));
}

TEST_CASE("a bent mesh gives the same distances as a mesh built bent") {
  const scene::BendField field = Hanging();
  const Pose X_FO{RotationFromRollPitchYaw({0.1, 0.2, 0.3}), Vec3(0.02, 0.01, 0.5)};
  const scene::TriangleMesh tool = Sphere(0.45F, 24, 36);
  const scene::CheckedMesh other = Checked(Sphere(0.1F, 16, 24));
  Interference scene, built;
  const std::size_t a = scene.Add(Checked(tool), X_FO, 1, true), b = scene.Add(other, {}, 1, false);
  built.Add(Checked(Bent(tool, field, X_FO)), {}, 1, false);
  built.Add(other, {}, 1, false);
  CHECK(scene.Bend(field));
  CHECK_FALSE(scene.Bend(field));
  std::mt19937 random(7);
  int touching = 0;
  for (int i = 0; i < 40; ++i) {
    const Pose X_WF = AnyPose(random), X_Wb = AnyPose(random);
    for (Interference* one : {&scene, &built}) {
      one->Place(a, X_WF);
      one->Place(b, X_Wb);
    }
    const Separation bent = scene.Measure(a, b, false), truth = built.Measure(a, b, false);
    CHECK(bent.touching == truth.touching);
    CHECK(bent.distance_m == Approx(truth.distance_m).margin(2e-7));
    touching += truth.touching ? 1 : 0;
  }
  CHECK(touching > 2);
  CHECK(touching < 38);
  const Vec3 p_O(0.1, 0.2, 0.3);
  scene.Place(a, {});
  CHECK(scene.PointOf(a, p_O).isApprox(scene::BentPoint(field, X_FO * p_O), 1e-12));
  CHECK(scene.Bend({}));  // straight again
  CHECK(scene.PointOf(a, p_O).isApprox(X_FO * p_O, 1e-12));
}

TEST_CASE("the nearest triangles of the previous call do not affect the result") {
  const scene::CheckedMesh mesh = Checked(Sphere(0.2F, 12, 20));
  Interference scene;
  const std::size_t a = scene.Add(mesh, {}, 1, false), b = scene.Add(mesh, {}, 1, false);
  std::mt19937 random(13);
  for (int i = 0; i < 60; ++i) {
    const Pose X_Wa = AnyPose(random), X_Wb = AnyPose(random);
    scene.Place(a, X_Wa);
    scene.Place(b, X_Wb);
    Interference fresh;
    fresh.Place(fresh.Add(mesh, {}, 1, false), X_Wa);
    fresh.Place(fresh.Add(mesh, {}, 1, false), X_Wb);
    for (int again = 0; again < 2; ++again) {
      const Separation found = scene.Measure(a, b, false), truth = fresh.Measure(0, 1, false);
      CHECK(found.touching == truth.touching);
      CHECK(found.distance_m == Approx(truth.distance_m).margin(1e-9));
      CHECK((found.p_b_W - found.p_a_W).norm() == Approx(found.distance_m).margin(1e-9));
    }
  }
}

TEST_CASE("distance of a point to a cuboid") {
  Interference scene;
  const std::size_t box = scene.Add(Checked(Cuboid({0.2F, 0.4F, 0.6F})), {}, 1, false);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> in(-1, 1);
  const Pose X_WB = AnyPose(random);
  scene.Place(box, X_WB);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p_B(in(random), in(random), in(random));
    const Vec3 beyond = (p_B.cwiseAbs() - Vec3(0.1, 0.2, 0.3)).cwiseMax(0);
    const Separation found = scene.FromPoint(X_WB * p_B, box);
    CHECK(found.inside == (beyond.norm() == 0));
    CHECK(found.distance_m == Approx(beyond.norm()).margin(2e-6));
  }
}

TEST_CASE("a sweep stops at the first contact and does not pass through thin objects") {
  Interference scene;
  const Pose X_KO{RotationFromRollPitchYaw({0, 0, 0.5}), Vec3(0.1, 0, 0)};
  const std::size_t module = scene.Add(Checked(Sphere(0.1F, 60, 80)), X_KO, 1, false);
  const std::size_t wall = scene.Add(Checked(Cuboid({0.002F, 2, 2})), {}, 1, false);
  const std::size_t far = scene.Add(Checked(Cuboid({1, 1, 1})), {}, 1, false);
  scene.Place(far, {Mat3::Identity(), Vec3(0, 0, 5)});
  scene.Place(wall, {Mat3::Identity(), Vec3(0.5, 0, 0)});
  const std::vector<Vec3> path = {Vec3(-1, 0, 0), Vec3(0, 0, 0), Vec3(3, 0, 0)};
  const SweepResult hit = scene.Sweep(module, {}, path, {far, wall});
  CHECK(hit.hits);
  CHECK(hit.other == 1);
  // Contact is found at most one step late.
  CHECK(hit.travelled_m == Approx(1.399).margin(1.1e-3));
  CHECK(hit.p_W.x() == Approx(0.499).margin(1.1e-3));
  CHECK(hit.least_m == 0);
  const SweepResult free = scene.Sweep(module, {Mat3::Identity(), Vec3(0, 0, 1.103)}, path, {wall});
  CHECK_FALSE(free.hits);
  CHECK(free.travelled_m == Approx(4));
  CHECK(free.least_m == Approx(0.003).margin(5e-4));
  CHECK(scene.Sweep(module, {}, {Vec3(0.5, 0, 0)}, {wall}).hits);
  CHECK_FALSE(scene.Sweep(module, {}, path, {}).hits);
}

}  // namespace plumbline::interference_test
