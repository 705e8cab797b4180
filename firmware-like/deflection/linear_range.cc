#include "firmware-like/deflection/linear_range.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/beam/beam.h"

namespace plumbline::deflection {
namespace {

/// Deflection of the beam alone, without the rotation of its coupling [m].
double BeamDeflection(const LoadedArm& arm, const LoadedState& state) {
  const int tool = state.tool.payload.tool;
  if (!arm.bends(tool)) return 0;
  return (state.bend_F - state.tool.root_F.cross(arm.X_FT(tool).p)).norm();
}

}  // namespace

double NeglectedByLinearTheory(const LoadedArm& arm, const LoadedState& state) {
  const double d = BeamDeflection(arm, state);
  if (d == 0) return 0;
  const loads::Payload& payload = state.tool.payload;
  const double length_m = arm.beam_tip_F(payload.tool).z();
  const auto& C = arm.tip_compliance(payload.tool).C_wrench;
  const double softest_m_per_N = state.tool.bend_factor * std::max(C(0, 0), C(1, 1));
  const double axial_N =
      std::abs(state.tool.g_F.z()) * (payload.mass_kg + arm.loads().tool_mass_kg(payload.tool));
  constexpr double kBuckling = 12 / (std::numbers::pi * std::numbers::pi);
  const double share = d / length_m;
  return d * (kBuckling * axial_N * softest_m_per_N / length_m + 2.0 / 3 * share +
              36.0 / 35 * share * share);
}

double BendShare(const LoadedArm& arm, const LoadedState& state) {
  const double d = BeamDeflection(arm, state);
  return d == 0 ? 0 : d / arm.beam_tip_F(state.tool.payload.tool).z();
}

std::optional<double> YieldShare(const model::Tool& tool, const LoadedState& state) {
  const auto has_yield = [](const model::ToolSegment& segment) {
    return segment.material.yield_strength_Pa.has_value();
  };
  if (std::ranges::none_of(tool.segments, has_yield)) return std::nullopt;
  const beam::Beam beam(tool, 1);
  const loads::Payload& payload = state.tool.payload;
  const beam::BeamSolution solution = beam.Solve(
      {.masses = {{.mass_kg = payload.mass_kg, .z_m = beam.Length(), .cog_F = payload.cog_F}},
       .g_F = state.tool.g_F});
  return YieldShare(solution);
}

std::optional<double> YieldShare(const beam::BeamSolution& solution) {
  std::optional<double> largest;
  for (int element = 0; element + 1 < solution.node_count(); ++element) {
    const model::Material& material = solution.elements()[element].material;
    const auto peak = beam::StressInElement(solution, element).peak;
    if (!material.yield_strength_Pa || !peak) continue;
    largest =
        std::max(largest.value_or(0), peak->stress.von_mises_Pa / *material.yield_strength_Pa);
  }
  return largest;
}

}  // namespace plumbline::deflection
