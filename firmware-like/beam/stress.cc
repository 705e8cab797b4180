#include "firmware-like/beam/stress.h"

#include <cmath>
#include <cstddef>
#include <utility>

namespace plumbline::beam {
namespace {

constexpr int kStations = 10;

/// Adds the zeros of V(s) = V0 - w0 s - w1 s^2/2 in (0, length).
void AddShearZeros(double v0, double w0, double w1, double length_m, std::vector<double>& at) {
  const double a = -w1 / 2;
  const double b = -w0;
  const double discriminant = b * b - 4 * a * v0;
  if (discriminant < 0) return;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  if (q == 0) return;
  for (const double s : {q / a, v0 / q}) {
    if (std::isfinite(s) && s > 0 && s < length_m) at.push_back(s);
  }
}

std::vector<double> StressStations(const BeamSolution& solution, int element) {
  const double length_m = solution.elements()[element].length_m;
  std::vector<double> at;
  for (int i = 0; i <= kStations; ++i) at.push_back(length_m * i / kStations);
  const Vec3 start_force_F = solution.InElement(element, 0).force_F;
  for (int plane = 0; plane < 2; ++plane) {
    const PlaneLoad& load = solution.LoadIn(element, plane);
    for (const PlanePointLoad& point : load.points) {
      at.push_back(point.s_m);
      at.push_back(std::nextafter(point.s_m, length_m));
    }
    // A point load in the element shifts the zeros outboard of it.
    double v0 = start_force_F[plane];
    AddShearZeros(v0, load.w0_N_m, load.w1_N_m2, length_m, at);
    for (const PlanePointLoad& point : load.points) {
      v0 -= point.force_N;
      AddShearZeros(v0, load.w0_N_m, load.w1_N_m2, length_m, at);
    }
  }
  return at;
}

}  // namespace

std::optional<SectionStress> StressOf(const model::Section& section, const SectionState& state) {
  if (section.reach_x_m <= 0 || section.reach_y_m <= 0) return std::nullopt;
  const double along_x_Pa = std::abs(state.moment_F.y()) * section.reach_x_m / section.iy_m4;
  const double along_y_Pa = std::abs(state.moment_F.x()) * section.reach_y_m / section.ix_m4;
  SectionStress stress;
  stress.normal_Pa = section.round ? std::hypot(along_x_Pa, along_y_Pa) : along_x_Pa + along_y_Pa;
  stress.shear_Pa = std::hypot(state.force_F.x() / section.peak_shear_x_m2,
                               state.force_F.y() / section.peak_shear_y_m2);
  stress.von_mises_Pa = std::hypot(stress.normal_Pa, std::sqrt(3.0) * stress.shear_Pa);
  return stress;
}

ElementStress StressInElement(const BeamSolution& solution, int element) {
  const model::Section& section = solution.elements()[element].section;
  ElementStress found;
  found.largest_moment = found.largest_shear = solution.InElement(element, 0);
  for (const double s_m : StressStations(solution, element)) {
    const SectionState state = solution.InElement(element, s_m);
    if (state.moment_F.norm() > found.largest_moment.moment_F.norm()) found.largest_moment = state;
    if (state.force_F.norm() > found.largest_shear.force_F.norm()) found.largest_shear = state;
    const auto stress = StressOf(section, state);
    if (stress && (!found.peak || stress->von_mises_Pa > found.peak->stress.von_mises_Pa)) {
      found.peak = ElementStress::Peak{state.z_m, *stress};
    }
  }
  return found;
}

LargestStress LargestStressOf(const BeamSolution& solution) {
  LargestStress largest;
  for (int element = 0; element + 1 < solution.node_count(); ++element) {
    const auto peak = StressInElement(solution, element).peak;
    if (!peak) {
      largest.complete = false;
    } else if (!largest.peak || peak->stress.von_mises_Pa > largest.peak->stress.von_mises_Pa) {
      largest.peak = peak;
      largest.element = element;
    }
  }
  return largest;
}

}  // namespace plumbline::beam
