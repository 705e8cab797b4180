// Tests of the parts that need no graphics context.
#include <catch2/catch.hpp>
#include <cmath>

#include "drivers/display/colour_scale.h"
#include "drivers/display/font.h"
#include "drivers/display/mesh_normals.h"
#include "tests/drivers/display/drawing_fixture.h"

namespace plumbline::parts_test {

using namespace plumbline::display;

namespace {

/// CIE lightness of an sRGB colour, 0..100.
double Lightness(const scene::Colour& colour) {
  const auto linear = [](float c) {
    const double x = static_cast<double>(c);
    return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
  };
  const double Y =
      0.2126 * linear(colour.r) + 0.7152 * linear(colour.g) + 0.0722 * linear(colour.b);
  return Y > 0.008856 ? 116 * std::cbrt(Y) - 16 : 903.3 * Y;
}

Vec3f NormalOf(const LitVertex& vertex) {
  return Vec3f(vertex.n_O[0], vertex.n_O[1], vertex.n_O[2]) / 32767.0F;
}

}  // namespace

TEST_CASE("the stress colours increase in lightness in even steps") {
  const double whole = Lightness(StressColour(1)) - Lightness(StressColour(0));
  CHECK(whole > 55);
  for (int i = 0; i < 20; ++i) {
    const double step = Lightness(StressColour((i + 1) / 20.0)) - Lightness(StressColour(i / 20.0));
    CAPTURE(i);
    CHECK(step > 0.6 * whole / 20);
    CHECK(step < 1.4 * whole / 20);
  }
  CHECK(Lightness(StressColour(7)) == Lightness(StressColour(1)));
  CHECK(Lightness(StressColour(-7)) == Lightness(StressColour(0)));
  CHECK(Lightness(StressColour(std::nan(""))) == Lightness(StressColour(0)));
}

TEST_CASE("normals are smooth around a bar and break at the edges of a box") {
  const LitMesh bar = ComputeNormals(test::Bar(0.1, 1, 10, 24));
  CHECK(bar.vertices.size() == 11 * 24);
  for (const LitVertex& vertex : bar.vertices) {
    const Vec3f outwards = Vec3f(vertex.p_O.x(), vertex.p_O.y(), 0).normalized();
    CHECK(NormalOf(vertex).dot(outwards) > 0.99F);
  }

  // Two squares at a right angle that share an edge: its two vertices have two normals each.
  scene::TriangleMesh corner{
      .vertices_O = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, -1}, {1, 1, -1}},
      .triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}}};
  const LitMesh lit = ComputeNormals(corner);
  CHECK(lit.vertices.size() == 8);
  for (std::size_t t = 0; t < 4; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const LitVertex& vertex = lit.vertices[lit.triangles[t][k]];
      CHECK(lit.source[lit.triangles[t][k]] == corner.triangles[t][k]);
      CHECK((NormalOf(vertex) - (t < 2 ? Vec3f::UnitZ() : Vec3f::UnitX())).norm() < 1e-4F);
    }
  }
}

TEST_CASE("triangles with separate but coincident vertices are lit as if they shared them") {
  const scene::TriangleMesh shared = test::Bar(0.1, 1, 4, 24);
  scene::TriangleMesh apart;
  for (const scene::Triangle& triangle : shared.triangles) {
    apart.triangles.push_back({});
    for (std::size_t k = 0; k < 3; ++k) {
      apart.triangles.back()[k] = static_cast<std::uint32_t>(apart.vertices_O.size());
      apart.vertices_O.push_back(shared.vertices_O[triangle[k]]);
    }
  }
  const LitMesh one = ComputeNormals(shared), other = ComputeNormals(apart);
  for (std::size_t t = 0; t < shared.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK((NormalOf(one.vertices[one.triangles[t][k]]) -
             NormalOf(other.vertices[other.triangles[t][k]]))
                .norm() < 1e-4F);
    }
  }
}

TEST_CASE("degenerate meshes get normals, and in bounded time") {
  scene::TriangleMesh fan{.vertices_O = {{0, 0, 0}},
                          .triangles = {}};  // 200,000 triangles at one vertex
  for (std::uint32_t i = 1; i <= 200'000; ++i) {
    fan.vertices_O.push_back(Vec3f(1, static_cast<float>(i), 0));
    fan.triangles.push_back({0, i, i});
    if (i > 1) fan.triangles.back() = {0, i - 1, i};
  }
  CHECK(ComputeNormals(fan).triangles.size() == 200'000);
  const LitMesh nothing = ComputeNormals({.vertices_O = {{1, 1, 1}}, .triangles = {{0, 0, 0}}});
  CHECK(NormalOf(nothing.vertices[0]) == Vec3f::UnitZ());
}

TEST_CASE("UTF-8 is decoded, each invalid byte becomes a replacement character") {
  CHECK(CodePointsFromUtf8("mm \xC2\xB1 \xE2\x89\xA4 \xF0\x9F\x94\xA7") ==
        U"mm \u00B1 \u2264 \U0001F527");
  CHECK(CodePointsFromUtf8("a\xFFz") == U"a\uFFFDz");
  CHECK(CodePointsFromUtf8("\xC0\x80") == U"\uFFFD\uFFFD");            // overlong encoding of zero
  CHECK(CodePointsFromUtf8("\xED\xA0\x80") == U"\uFFFD\uFFFD\uFFFD");  // surrogate
  CHECK(CodePointsFromUtf8("\xE2\x89") == U"\uFFFD\uFFFD");            // truncated
  CHECK(CodePointsFromUtf8("\xF4\x90\x80\x80").size() == 4);           // beyond U+10FFFF
}

TEST_CASE("a part of a picture is cut out, within the picture") {
  RgbImage picture;
  picture.size = {4, 3};
  for (std::uint8_t k = 0; k < 36; ++k) picture.rgb.push_back(k);
  const RgbImage part = Cropped(picture, 1, 1, {2, 5});
  CHECK(part.size == image::ImageSize{2, 2});
  CHECK(part.rgb == std::vector<std::uint8_t>{15, 16, 17, 18, 19, 20, 27, 28, 29, 30, 31, 32});
  CHECK(Cropped(picture, 9, -2, {2, 2}).rgb.empty());
}

}  // namespace plumbline::parts_test
