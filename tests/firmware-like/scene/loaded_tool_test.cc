#include "firmware-like/scene/loaded_tool.h"

#include <catch2/catch.hpp>
#include <functional>

#include "firmware-like/beam/beam.h"
#include "firmware-like/model/materials.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::loaded_tool_test {

using namespace plumbline::scene;

namespace {

model::WrittenEffect WrittenOf(const char* id, const char* parameter, double value,
                               const char* unit) {
  model::WrittenEffect effect;
  effect.id = id;
  effect.parameters.push_back({parameter, value, std::nullopt, unit, ""});
  return effect;
}

model::ToolSegment Segment(double length_m, const model::Section& section, const char* material) {
  return {.length_m = length_m, .section = section, .material = *model::MaterialByName(material)};
}

model::CellModel CellWith(const std::vector<model::ToolSegment>& segments,
                          model::BeamTheory theory) {
  model::CellModel cell = test::HeavyArm();
  cell.tool.segments = segments;
  cell.tool.theory = theory;
  cell.tool.tcp_F = Vec3(0, 0, cell.tool.Length());
  cell.payload_cog_F = Vec3(0.02, 0.05, cell.tool.Length() + 0.1);
  return cell;
}

struct NamedCell {
  const char* name;
  model::CellModel cell;
};

/// Section steps lie between the even stations, also near the flange and near the tip.
std::vector<NamedCell> Cells() {
  const auto box = [](double side, double wall) { return model::SquareTubeSection(side, wall); };
  return {
      {"one box", test::HeavyArm()},
      {"steel, then aluminium", CellWith({Segment(0.11, box(0.08, 0.005), "steel"),
                                          Segment(0.79, box(0.08, 0.005), "aluminium_6061")},
                                         model::BeamTheory::kEulerBernoulli)},
      {"four pieces",
       CellWith({Segment(0.01, model::RodSection(0.06, 0.3), "steel"),
                 Segment(0.5, model::IBeamSection(0.09, 0.06, 0.005, 0.008), "steel"),
                 Segment(0.47, model::RectangleSection(0.05, 0.07), "aluminium_6061"),
                 Segment(0.012, model::TubeSection(0.06, 0.005, 0.3), "steel")},
                model::BeamTheory::kTimoshenko)},
      {"short and thick",
       CellWith({Segment(0.3, box(0.1, 0.01), "steel")}, model::BeamTheory::kTimoshenko)},
      {"soft", CellWith({Segment(0.216, box(0.05, 0.004), "steel"),
                         Segment(0.6, box(0.05, 0.003), "aluminium_6061")},
                        model::BeamTheory::kEulerBernoulli)},
      {"slender",
       CellWith({Segment(1.8, box(0.06, 0.004), "steel")}, model::BeamTheory::kTimoshenko)},
  };
}

deflection::LoadedState Loaded(const model::CellModel& cell, double payload_kg,
                               std::mt19937& random) {
  deflection::LoadedState state;
  const model::JointVector q = test::RandomPosture(cell, random);
  REQUIRE(deflection::LoadedArm(cell).AtCommanded(q, {payload_kg, *cell.payload_cog_F}, {}, state));
  return state;
}

/// The declared beam, solved with more elements than the field uses.
beam::BeamSolution Declared(const model::Tool& tool, const deflection::LoadedState& state) {
  const beam::PointMass payload{.mass_kg = state.tool.payload.mass_kg,
                                .z_m = tool.Length(),
                                .cog_F = state.tool.payload.cog_F};
  return beam::Beam(tool, 3).Solve({.masses = {payload}, .g_F = state.tool.g_F});
}

}  // namespace

TEST_CASE("the tip of the field equals the tip of the loaded arm, with any effects") {
  const std::vector<std::vector<model::WrittenEffect>> effects = {
      {},
      {WrittenOf("tool_stiffness", "ratio", -0.3, "1")},
      {WrittenOf("tool_shear", "kappa", 0.4, "1")},
      {WrittenOf("tool_root_compliance", "compliance", 2e-6, "rad/(N m)")},
      {WrittenOf("payload_mass", "constant", 7, "kg"),
       WrittenOf("tool_stiffness", "ratio", 0.2, "1"), WrittenOf("tool_shear", "kappa", 0.6, "1"),
       WrittenOf("tool_root_compliance", "compliance", 1e-6, "rad/(N m)"),
       WrittenOf("pedestal_compliance", "compliance", 2e-7, "rad/(N m)")}};
  std::mt19937 random(21);
  for (const auto& [name, declared] : Cells()) {
    for (std::size_t k = 0; k < effects.size(); ++k) {
      model::CellModel cell = declared;
      cell.effects = effects[k];
      const deflection::LoadedState state = Loaded(cell, 60, random);
      const BendField field = BendFieldOf(cell.tool, state);
      CAPTURE(name, k, state.bend_F.transpose());
      CHECK(state.bend_F.norm() > 1e-6);
      CHECK((field.stations.back().d_F.cast<double>() - state.bend_F).norm() < 1e-7);
      CHECK((field.stations.back().r_F.cast<double>() - state.slope_F).norm() < 1e-7);
      CHECK(field.stations.front().d_F.norm() == 0);
    }
  }
}

TEST_CASE("stations match the beam's sections, and points between them to 0.01 mm") {
  std::mt19937 random(22);
  for (const auto& [name, cell] : Cells()) {
    for (int trial = 0; trial < 20; ++trial) {
      const deflection::LoadedState state = Loaded(cell, 60, random);
      const BendField field = BendFieldOf(cell.tool, state);
      const beam::BeamSolution beam = Declared(cell.tool, state);
      const double length_m = cell.tool.Length();
      CAPTURE(name, trial, state.bend_F.transpose());
      for (int i = 0; i < kBendStations; ++i) {
        const beam::SectionState section = beam.At(std::min(field.StationZ(i), length_m));
        const BendStation& station = field.stations[static_cast<std::size_t>(i)];
        CHECK((station.d_F.cast<double>() - section.d_F).norm() < 1e-7);
        CHECK((station.r_F.cast<double>() - section.r_F).norm() < 1e-7);
        if (i > 0) CHECK(field.StationZ(i) > field.StationZ(i - 1));
      }
      double worst_m = 0;
      for (int k = 0; k < 1234; ++k) {
        const double z = length_m * k / 1234;
        const beam::SectionState section = beam.At(z);
        for (const Vec3& beside : {Vec3(0.4, 0, 0), Vec3(0, 0.4, 0), Vec3(-0.3, 0.3, 0)}) {
          const Vec3 p = beside + Vec3(0, 0, z);
          const Vec3 bent = p + section.d_F + section.r_F.cross(beside);
          worst_m = std::max(worst_m, (BentPoint(field, p) - bent).norm());
        }
      }
      CHECK(worst_m < 1e-5);
    }
  }
}

TEST_CASE("there is a station at every step of the section") {
  std::mt19937 random(23);
  for (const auto& [name, cell] : Cells()) {
    const BendField field = BendFieldOf(cell.tool, Loaded(cell, 60, random));
    double end_m = 0;
    for (const model::ToolSegment& segment : cell.tool.segments) {
      end_m += segment.length_m;
      double nearest_m = 1;
      for (int i = 0; i < kBendStations; ++i) {
        nearest_m = std::min(nearest_m, std::abs(field.StationZ(i) - end_m));
      }
      CAPTURE(name, end_m);
      CHECK(nearest_m < 1e-7);
    }
  }
}

TEST_CASE("effects act along the whole tool as defined, not only at its tip") {
  std::mt19937 random(24);
  const model::CellModel cell = Cells()[1].cell;
  deflection::LoadedState state = Loaded(cell, 60, random);
  const beam::BeamSolution beam = Declared(cell.tool, state);
  state.tool.bend_factor = 1.5;
  state.tool.shear = 2.4;
  state.tool.root_F = Vec3(1e-4, -3e-4, 0);
  const BendField field = BendFieldOf(cell.tool, state);
  const Vec3 force_N = state.tool.payload.mass_kg * state.tool.g_F;
  for (const int i : {1, 9, 20, 32}) {
    const double z = std::min(field.StationZ(i), cell.tool.Length());
    double shear_m_per_N = 0;
    for (const model::ToolSegment& segment : cell.tool.segments) {
      const double within_m =
          &segment == &cell.tool.segments[0] ? std::min(z, 0.11) : std::max(0.0, z - 0.11);
      shear_m_per_N += within_m / (segment.material.ShearModulus() * segment.section.area_m2);
    }
    Vec3 d = 1.5 * beam.At(z).d_F + 2.4 * shear_m_per_N * Vec3(force_N.x(), force_N.y(), 0);
    d += Vec3(-3e-4 * z, -1e-4 * z, 0);
    const BendStation& station = field.stations[static_cast<std::size_t>(i)];
    CAPTURE(i, z);
    CHECK((station.d_F.cast<double>() - d).norm() < 1e-8);
    CHECK((station.r_F.cast<double>() - 1.5 * beam.At(z).r_F - state.tool.root_F).norm() < 1e-8);
  }
}

TEST_CASE("the stress is that of the declared sections, the larger value at a step") {
  std::mt19937 random(25);
  const model::CellModel cell = Cells()[1].cell;
  const deflection::LoadedState state = Loaded(cell, 60, random);
  const beam::BeamSolution beam = Declared(cell.tool, state);
  const BendField field = BendFieldOf(cell.tool, state);
  const auto at = [&](std::size_t segment, double z) {
    return beam::StressOf(cell.tool.segments[segment].section, beam.At(z))->von_mises_Pa;
  };
  CHECK(field.stations[0].stress_Pa == Approx(at(0, 0)));
  CHECK(field.stations[20].stress_Pa == Approx(at(1, field.StationZ(20))));
  CHECK(field.stations[32].stress_Pa == Approx(at(1, cell.tool.Length())));

  model::CellModel thinner =
      CellWith({Segment(0.45, model::SquareTubeSection(0.08, 0.005), "steel"),
                Segment(0.45, model::SquareTubeSection(0.04, 0.005), "steel")},
               model::BeamTheory::kEulerBernoulli);
  const deflection::LoadedState bent = Loaded(thinner, 60, random);
  const beam::BeamSolution solved = Declared(thinner.tool, bent);
  const double thin_Pa =
      beam::StressOf(thinner.tool.segments[1].section, solved.At(0.45))->von_mises_Pa;
  CHECK(BendFieldOf(thinner.tool, bent).stations[16].stress_Pa == Approx(thin_Pa));

  thinner.tool.segments[0].section = model::SectionFromMoments(1e-3, 1e-6, 1e-6);
  const BendField half_known = BendFieldOf(thinner.tool, bent);
  CHECK(half_known.stations[3].stress_Pa == 0);
  CHECK(half_known.stations[20].stress_Pa > 0);
}

TEST_CASE("a rigid tool is straight, and rotates with a compliant seat") {
  model::CellModel cell = test::HeavyArm();
  cell.tool = model::Tool{};
  cell.tool.tcp_F = Vec3(0.1, -0.2, 0.5);
  std::mt19937 random(26);
  CHECK(BendFieldOf(cell.tool, Loaded(cell, 60, random)).length_m == 0);
  cell.effects = {WrittenOf("tool_root_compliance", "compliance", 1e-6, "rad/(N m)")};
  const deflection::LoadedState state = Loaded(cell, 60, random);
  const BendField field = BendFieldOf(cell.tool, state);
  const Vec3 tip = cell.tool.tcp_F;
  CHECK(state.bend_F.norm() > 1e-6);
  CHECK((BentPoint(field, tip) - tip - state.bend_F).norm() < 1e-7);
  CHECK((field.stations[5].r_F.cast<double>() - state.slope_F).norm() < 1e-7);
  cell.tool.tcp_F.z() = -0.1;
  CHECK(BendFieldOf(cell.tool, Loaded(cell, 60, random)).length_m == 0);
}

}  // namespace plumbline::loaded_tool_test
