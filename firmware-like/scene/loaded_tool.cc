#include "firmware-like/scene/loaded_tool.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware-like/beam/beam.h"

namespace plumbline::scene {
namespace {

using StationPlaces = std::array<double, kBendStations>;

/// Evenly spaced positions, with the nearest free station moved to each joint between segments.
StationPlaces PlacesOfStations(const model::Tool& tool, double length_m) {
  StationPlaces z{};
  const double step_m = length_m / (kBendStations - 1);
  for (int i = 0; i < kBendStations; ++i) z[i] = i * step_m;
  z.back() = length_m;
  double end_m = 0;
  int taken = 0;
  for (std::size_t k = 0; k + 1 < tool.segments.size(); ++k) {
    end_m += tool.segments[k].length_m;
    const int nearest = std::min(static_cast<int>(std::lround(end_m / step_m)), kBendStations - 2);
    const int i = std::max(taken + 1, nearest);
    if (i > kBendStations - 2) break;
    z[i] = end_m;
    taken = i;
  }
  return z;
}

/// Integral of ds / (G A) from the root to z.
double ShearCompliance(const model::Tool& tool, double z_m) {
  double sum_m_per_N = 0, start_m = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    const double in_it_m = std::clamp(z_m - start_m, 0.0, segment.length_m);
    sum_m_per_N += in_it_m / (segment.material.ShearModulus() * segment.section.area_m2);
    start_m += segment.length_m;
  }
  return sum_m_per_N;
}

/// The larger von Mises stress of the two sides of a section.
double StressAt(const beam::BeamSolution& solution, double z_m) {
  double largest_Pa = 0;
  const int inboard = solution.ElementAt(z_m);
  for (const int element : {inboard, inboard + 1}) {
    if (element + 1 >= solution.node_count()) continue;
    const model::ToolSegment& segment = solution.elements()[element];
    const double s_m = z_m - solution.NodeZ(element);
    if (s_m < -1e-9 * segment.length_m) continue;  // the outboard element starts further out
    const beam::SectionState state =
        solution.InElement(element, std::clamp(s_m, 0.0, segment.length_m));
    if (const auto stress = beam::StressOf(segment.section, state)) {
      largest_Pa = std::max(largest_Pa, stress->von_mises_Pa);
    }
  }
  return largest_Pa;
}

void AddBeam(const model::Tool& tool, const deflection::ToolStateInputOf<double>& load,
             const FlangeAcceleration& inertia, const StationPlaces& z, BendField& field) {
  const beam::Beam beam(tool, 1);
  const beam::PointMass payload{
      .mass_kg = load.payload.mass_kg, .z_m = beam.Length(), .cog_F = load.payload.cog_F};
  const beam::BeamSolution solution = beam.Solve({.masses = {payload},
                                                  .g_F = load.g_F,
                                                  .acceleration_F = inertia.linear_F,
                                                  .angular_acceleration_F = inertia.angular_F});
  Vec3 shear_N = load.shear * load.payload.mass_kg *
                 (load.g_F - inertia.linear_F - inertia.angular_F.cross(load.payload.cog_F));
  shear_N.z() = 0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    const beam::SectionState section = solution.At(z[i]);
    const Vec3 d = load.bend_factor * section.d_F + ShearCompliance(tool, z[i]) * shear_N +
                   load.root_F.cross(Vec3(0, 0, z[i]));
    field.stations[i].d_F = d.cast<float>();
    field.stations[i].r_F = (load.bend_factor * section.r_F + load.root_F).cast<float>();
    field.stations[i].stress_Pa = static_cast<float>(StressAt(solution, z[i]));
  }
}

}  // namespace

BendField BendFieldOf(const model::Tool& tool, const deflection::LoadedState& state,
                      const FlangeAcceleration& inertia) {
  BendField field;
  const bool seat_yields = !state.tool.root_F.isZero(0);
  if (tool.rigid && !(seat_yields && tool.tcp_F.z() > 0)) return field;
  const double length_m = tool.rigid ? tool.tcp_F.z() : tool.Length();
  field.length_m = static_cast<float>(length_m);
  const StationPlaces z = PlacesOfStations(tool, length_m);
  for (std::size_t i = 0; i < z.size(); ++i) {
    const double even_m = static_cast<double>(i) * (length_m / (kBendStations - 1));
    field.stations[i].off_m = static_cast<float>(z[i] - even_m);
    if (!tool.rigid) continue;
    field.stations[i].d_F = state.tool.root_F.cross(Vec3(0, 0, z[i])).cast<float>();
    field.stations[i].r_F = state.tool.root_F.cast<float>();
  }
  if (!tool.rigid) AddBeam(tool, state.tool, inertia, z, field);
  return field;
}

}  // namespace plumbline::scene
