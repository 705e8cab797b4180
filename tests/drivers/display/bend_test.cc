// Bending in the vertex shader, read back from the GPU by transform feedback.
#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/beam/beam.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/materials.h"
#include "firmware-like/scene/loaded_tool.h"
#include "tests/drivers/display/drawing_fixture.h"

namespace plumbline::bend_test {

using namespace plumbline::display;

namespace {

struct LoadedTool {
  const char* name;
  model::Tool tool;
  deflection::LoadedState state;  ///< only the loads that bend the tool
};

LoadedTool Loaded(const char* name, std::vector<model::ToolSegment> segments,
                  model::BeamTheory theory, double payload_kg, const Vec3& g_F) {
  LoadedTool loaded{.name = name, .tool = {}, .state = {}};
  loaded.tool.rigid = false;
  loaded.tool.theory = theory;
  loaded.tool.segments = std::move(segments);
  const double length_m = loaded.tool.Length();
  loaded.tool.tcp_F = Vec3(0, 0, length_m);
  loaded.state.tool.g_F = g_F;
  loaded.state.tool.payload = {payload_kg, Vec3(0.05, -0.03, length_m + 0.15)};
  return loaded;
}

std::vector<LoadedTool> Tools() {
  const model::Material steel = *model::MaterialByName("steel"),
                        aluminium = *model::MaterialByName("aluminium_6061");
  const auto box = model::SquareTubeSection;
  return {Loaded("1.2 m box", {{1.2, box(0.08, 0.005), steel}}, model::BeamTheory::kEulerBernoulli,
                 60, Vec3(6, -7, 3)),
          Loaded("1.8 m, slender: a fiftieth of its length", {{1.8, box(0.05, 0.004), steel}},
                 model::BeamTheory::kEulerBernoulli, 35, Vec3(9.8, 0, 0)),
          Loaded("two materials",
                 {{0.313, box(0.05, 0.004), steel}, {0.6, box(0.05, 0.003), aluminium}},
                 model::BeamTheory::kTimoshenko, 60, Vec3(3, 9, -2)),
          Loaded("short", {{0.25, model::RodSection(0.03, 0.3), steel}},
                 model::BeamTheory::kTimoshenko, 80, Vec3(-5, 8, 2))};
}

beam::BeamSolution Solved(const LoadedTool& loaded) {
  const auto& load = loaded.state.tool;
  const beam::PointMass payload{load.payload.mass_kg, loaded.tool.Length(), load.payload.cog_F};
  return beam::Beam(loaded.tool, 4).Solve({.masses = {payload}, .g_F = load.g_F});
}

/// Displaced point according to the beam section, from the finite elements alone.
Vec3 CarriedByBeam(const beam::BeamSolution& beam, double length_m, const Vec3& p_F) {
  if (p_F.z() <= 0) return p_F;
  const double z = std::min(p_F.z(), length_m);
  const beam::SectionState section = beam.At(z);
  return p_F + section.d_F + section.r_F.cross(p_F - Vec3(0, 0, z));
}

/// A 1.4 m module beside the tool and beyond its tip, and the bar itself, in the object frame.
scene::TriangleMesh Module(double length_m) {
  scene::TriangleMesh mesh = test::Bar(0.1, length_m, 60, 24);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> beside(-0.5F, 0.5F), along(-0.2F, 1.3F);
  for (int i = 0; i < 3000; ++i) {
    mesh.triangles.push_back({});
    for (std::uint32_t& vertex : mesh.triangles.back()) {
      vertex = static_cast<std::uint32_t>(mesh.vertices_O.size());
      mesh.vertices_O.push_back(
          Vec3f(beside(random), beside(random), along(random) * static_cast<float>(length_m)));
    }
  }
  return mesh;
}

}  // namespace

TEST_CASE("every vertex matches the finite elements of the beam to 0.01 mm") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  for (const LoadedTool& loaded : Tools()) {
    const double length_m = loaded.tool.Length();
    const beam::BeamSolution beam = Solved(loaded);
    scene::DisplayList list = test::EmptyList({640, 480});
    list.bend = scene::BendFieldOf(loaded.tool, loaded.state);
    const scene::TriangleMesh mesh = Module(length_m);
    scene::DrawnMesh drawn =
        test::Placed(drawing.renderer->LoadMesh(mesh).value(), Vec3(0.3, -0.2, 1.5), {});
    drawn.bends = true;
    drawn.X_CF.R = RotationFromRollPitchYaw(Vec3(0.4, -1.1, 2.0));
    drawn.X_FO = {RotationFromRollPitchYaw(Vec3(0.02, 0.03, -0.7)), Vec3(0.02, 0.01, 0.03)};
    drawn.scale = 0.9;
    for (const double exaggeration : {1.0, 20.0}) {
      list.exaggeration = exaggeration;
      const std::vector<Vec3f> placed = drawing.renderer->TransformedVertices(list, drawn);
      REQUIRE(placed.size() == mesh.vertices_O.size());
      double from_beam_m = 0, from_field_m = 0, moved_m = 0;
      for (std::size_t i = 0; i < placed.size(); ++i) {
        const Vec3 p_O = drawn.scale * mesh.vertices_O[i].cast<double>();
        const Vec3 straight_F = drawn.X_FO * p_O;
        const Vec3 got_F = drawn.X_CF.Inverse() * placed[i].cast<double>().eval();
        const Vec3 bent_F = (got_F - straight_F) / exaggeration + straight_F;
        from_field_m =
            std::max(from_field_m, (bent_F - scene::BentPoint(list.bend, straight_F)).norm());
        from_beam_m =
            std::max(from_beam_m, (bent_F - CarriedByBeam(beam, length_m, straight_F)).norm());
        moved_m = std::max(moved_m, (bent_F - straight_F).norm());
      }
      std::printf(
          "%-45s x %2.0f: moves up to %6.2f mm, from the beam %.5f mm, from the field %.5f mm\n",
          loaded.name, exaggeration, 1e3 * moved_m, 1e3 * from_beam_m, 1e3 * from_field_m);
      CAPTURE(loaded.name, exaggeration);
      CHECK(moved_m > 3e-4);
      CHECK(from_field_m < 2e-6);
      CHECK(from_beam_m < 1e-5);
    }
  }
}

TEST_CASE("a rigid mesh follows its poses regardless of the bend") {
  test::Drawing drawing;
  if (!drawing.renderer) return;
  const LoadedTool loaded = Tools()[0];
  scene::DisplayList list = test::EmptyList({640, 480});
  list.bend = scene::BendFieldOf(loaded.tool, loaded.state);
  const scene::TriangleMesh mesh = Module(1.2);
  scene::DrawnMesh drawn =
      test::Placed(drawing.renderer->LoadMesh(mesh).value(), Vec3(0.3, -0.2, 1.5), {});
  drawn.scale = 2;
  const std::vector<Vec3f> placed = drawing.renderer->TransformedVertices(list, drawn);
  REQUIRE(placed.size() == mesh.vertices_O.size());
  float worst_m = 0;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    worst_m =
        std::max(worst_m, (placed[i] - (2 * mesh.vertices_O[i] + Vec3f(0.3F, -0.2F, 1.5F))).norm());
  }
  CHECK(worst_m < 1e-6F);
}

}  // namespace plumbline::bend_test
