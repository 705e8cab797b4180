// Stress in the beam from bending moments and shear forces.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/beam/beam.h"

namespace plumbline::beam {

/// Stress in one section; magnitudes without sign.
struct SectionStress {
  double normal_Pa = 0;     ///< at the outermost fibre
  double shear_Pa = 0;      ///< at the neutral axis
  double von_mises_Pa = 0;  ///< upper bound: sqrt(normal^2 + 3 shear^2)
};

/// Stress of a section under a shear force and a bending moment.
///   normal = |My| reach_x / Iy + |Mx| reach_y / Ix   (at a corner; round: root of sum of squares)
///   shear  = hypot(Vx / peak_x, Vy / peak_y)         [Gere & Timoshenko, ch. 5]
/// Normal and shear stress peak at different fibres, so within beam theory the von Mises value is
/// an upper bound. Stress concentrations at notches, welds and the clamp are not included.
/// @return nullopt if the outermost fibre of the section is unknown
std::optional<SectionStress> StressOf(const model::Section& section, const SectionState& state);

/// The most loaded section of an element.
struct ElementStress {
  SectionState largest_moment;  ///< where |M| is largest
  SectionState largest_shear;   ///< where |V| is largest
  struct Peak {
    double z_m = 0;
    SectionStress stress;
  };
  std::optional<Peak> peak;  ///< where the von Mises stress is largest; nullopt if unknown
};

/// Largest moment, shear force and stress of one element, evaluated at both ends, on both sides of
/// each load, at zeros of the shear force, and at nine intermediate stations.
ElementStress StressInElement(const BeamSolution& solution, int element);

/// Largest stress of the beam and its location.
struct LargestStress {
  std::optional<ElementStress::Peak> peak;  ///< nullopt if unknown in every element
  int element = 0;                          ///< index of the element
  bool complete = true;  ///< false if the outermost fibre of a section is unknown
};
LargestStress LargestStressOf(const BeamSolution& solution);

}  // namespace plumbline::beam
