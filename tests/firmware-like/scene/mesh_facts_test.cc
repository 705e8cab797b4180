// Meshes with known properties, and invalid ones.
#include "firmware-like/scene/mesh_facts.h"

#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "tests/app/cell/scene/shapes.h"

namespace plumbline::mesh_facts_test {

using namespace plumbline::scene;
using test::Cuboid;
using test::Sphere;

namespace {

MeshFacts FactsOf(const TriangleMesh& mesh, double unit_m = 1) {
  const auto checked = CheckMesh(mesh, unit_m);
  INFO((checked ? "" : checked.error()));
  REQUIRE(checked);
  for (const Triangle& triangle : checked->mesh.triangles) {
    for (const std::uint32_t i : triangle) CHECK(i < checked->mesh.vertices_O.size());
  }
  return checked->facts;
}

/// The same triangles, each with its own vertices, as in an STL file.
TriangleMesh Loose(const TriangleMesh& mesh) {
  TriangleMesh loose;
  for (const Triangle& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(loose.vertices_O.size());
    for (const std::uint32_t i : triangle) loose.vertices_O.push_back(mesh.vertices_O[i]);
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  return loose;
}

}  // namespace

TEST_CASE("a cuboid in millimetres: merged vertices, size, volume, facing") {
  for (const TriangleMesh& mesh : {Cuboid({600, 50, 40}), Loose(Cuboid({600, 50, 40}))}) {
    const MeshFacts facts = FactsOf(mesh, 1e-3);
    CHECK(facts.vertices == 8);
    CHECK(facts.triangles == 12);
    CHECK(facts.degenerate == 0);
    CHECK(facts.closed());
    CHECK(facts.facing() == Facing::kOutwards);
    CHECK(facts.parts == 1);
    CHECK(facts.volume_m3 == Approx(0.6 * 0.05 * 0.04).epsilon(1e-6));
    CHECK(facts.max_O.isApprox(Vec3(0.3, 0.025, 0.02), 1e-6));
    CHECK(facts.min_O.isApprox(-Vec3(0.3, 0.025, 0.02), 1e-6));
  }
}

TEST_CASE("a triangulated sphere approaches the volume of a ball; two spheres are two parts") {
  TriangleMesh mesh = Sphere(0.3F, 60, 120);
  CHECK(mesh.triangles.size() == 2 * 120 * 59);
  const MeshFacts one = FactsOf(mesh);
  CHECK(one.volume_m3 == Approx(4.0 / 3 * std::numbers::pi * 0.027).epsilon(3e-3));
  const auto count = static_cast<std::uint32_t>(mesh.vertices_O.size());
  const std::size_t triangles = mesh.triangles.size();
  for (std::uint32_t i = 0; i < count; ++i) {
    mesh.vertices_O.push_back(mesh.vertices_O[i] + Vec3f(1, 0, 0));
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    const Triangle t = mesh.triangles[i];
    mesh.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  }
  const MeshFacts two = FactsOf(mesh);
  CHECK(two.parts == 2);
  REQUIRE(two.ends.size() == 2);
  for (std::size_t part = 0; part < 2; ++part) {
    for (std::size_t end = 0; end < 6; ++end) {
      const Vec3f p = CheckMesh(mesh, 1)->mesh.vertices_O[two.ends[part][end]];
      const Vec3f from_middle = p - Vec3f(static_cast<float>(part), 0, 0);
      CHECK(from_middle[static_cast<int>(end % 3)] == Approx(end < 3 ? -0.3 : 0.3).epsilon(1e-4));
    }
  }
  CHECK(two.volume_m3 == Approx(2 * one.volume_m3).epsilon(1e-5));
}

TEST_CASE("open edges, reversed triangles and inward-facing surfaces are detected") {
  TriangleMesh open = Cuboid({1, 1, 1});
  open.triangles.resize(10);
  CHECK(FactsOf(open).open_edges == 4);
  CHECK(FactsOf(open).facing() == Facing::kNotClosed);
  CHECK(FactsOf(open).volume_m3 == 0);

  TriangleMesh inwards = Cuboid({1, 1, 1});
  for (Triangle& triangle : inwards.triangles) std::swap(triangle[1], triangle[2]);
  CHECK(FactsOf(inwards).facing() == Facing::kInwards);
  CHECK(FactsOf(inwards).volume_m3 == Approx(-1));

  TriangleMesh mixed = Cuboid({1, 1, 1});
  std::swap(mixed.triangles[3][1], mixed.triangles[3][2]);
  CHECK(FactsOf(mixed).closed());
  CHECK(FactsOf(mixed).opposed_edges == 3);
  CHECK(FactsOf(mixed).facing() == Facing::kMixed);
}

TEST_CASE(
    "triangles without area are counted and removed; a collapsed edge does not open the surface") {
  TriangleMesh mesh = Cuboid({1, 1, 1});
  mesh.vertices_O.emplace_back(0.5F, 0.5F, 0.5F);   // vertex 7 once more
  mesh.triangles.push_back({7, 8, 0});              // no area after merging
  mesh.vertices_O.emplace_back(0.0F, 0.0F, -0.5F);  // in the middle of an edge's diagonal
  mesh.triangles.push_back({1, 9, 2});              // three places on one line
  mesh.vertices_O.emplace_back(9.0F, 9.0F, 9.0F);   // unused
  const MeshFacts facts = FactsOf(mesh);
  CHECK(facts.degenerate == 2);
  CHECK(facts.triangles == 12);
  CHECK(facts.vertices == 8);
  CHECK(facts.max_O.x() == 0.5);
  CHECK_FALSE(facts.closed());  // the second one has its own edges
}

TEST_CASE("invalid meshes are refused with a count") {
  const auto why = [](const TriangleMesh& mesh, double unit_m = 1) {
    const auto checked = CheckMesh(mesh, unit_m);
    REQUIRE_FALSE(checked);
    return checked.error();
  };
  CHECK_THAT(why({}), Catch::Contains("no triangle"));
  TriangleMesh mesh = Cuboid({1, 1, 1});
  mesh.triangles[2][1] = 8;
  CHECK_THAT(why(mesh), Catch::Contains("1 of 12 triangles refer to missing vertices"));
  mesh = Cuboid({1, 1, 1});
  mesh.vertices_O[0].x() = std::numeric_limits<float>::quiet_NaN();
  CHECK_THAT(why(mesh), Catch::Contains("not a finite number"));
  mesh.vertices_O[0].x() = std::numeric_limits<float>::infinity();
  CHECK_THAT(why(mesh), Catch::Contains("not a finite number"));
  mesh.vertices_O[0].x() = 3e38F;
  CHECK_THAT(why(mesh), Catch::Contains("1000 km"));
  CHECK_THAT(why(mesh, 1000), Catch::Contains("not a finite number"));
  mesh = {{Vec3f(0, 0, 0), Vec3f(1, 1, 1), Vec3f(2, 2, 2)}, {{0, 1, 2}}};
  CHECK_THAT(why(mesh), Catch::Contains("all triangles have zero area"));
}

}  // namespace plumbline::mesh_facts_test
