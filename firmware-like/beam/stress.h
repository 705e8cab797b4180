// Stress in the beam from its moments and shear forces.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/beam/beam.h"

namespace plumbline {

/// Stress in one section; all are amounts, not signed.
struct SectionStress {
  double normal_Pa = 0;     ///< at the outermost fibre
  double shear_Pa = 0;      ///< at the neutral axis
  double von_mises_Pa = 0;  ///< bound: sqrt(normal^2 + 3 shear^2)
};

/// Stress of a section under a shear force and a bending moment.
///   normal = |My| reach_x / Iy + |Mx| reach_y / Ix   (corner; root of the squares where round)
///   shear  = hypot(Vx / peak_x, Vy / peak_y)         [Gere & Timoshenko, ch. 5]
/// Normal and shear stress peak at different fibres, so that the von Mises value is never too small
/// by beam theory; notches, welds and the clamp's own stress concentration are not in it.
/// @return nothing where the section's outermost fibre is not known
std::optional<SectionStress> StressOf(const Section& section, const SectionState& state);

/// The most loaded section of an element.
struct ElementStress {
  SectionState largest_moment;  ///< where |M| is largest
  SectionState largest_shear;   ///< where |V| is largest
  struct Peak {
    double z_m = 0;
    SectionStress stress;
  };
  std::optional<Peak> peak;  ///< where the von Mises stress is largest; nothing: not known
};

/// Moment, shear and stress of one element, looked for at both ends, both sides of each load in
/// it, where a shear force changes sign, and at nine stations between.
ElementStress StressInElement(const BeamSolution& solution, int element);

/// The largest stress of the beam and its place.
struct LargestStress {
  std::optional<ElementStress::Peak> peak;  ///< nothing: not known in any element
  int element = 0;                          ///< in which it lies
  bool complete = true;  ///< false: some elements' sections do not tell their outermost fibre
};
LargestStress LargestStressOf(const BeamSolution& solution);

}  // namespace plumbline
