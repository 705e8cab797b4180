// The bend of a cell's tool in the moment, effects included, as its mesh follows it.
#pragma once

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline {

/// Every section of the loaded tool:
///   d(z) = factor d_beam(z) + shear F integral_0^z ds / (G A) + root x (0, 0, z)
///   r(z) = factor r_beam(z) + root
/// with d_beam, r_beam of the declared beam's finite elements (beam/beam.h) under its own weight
/// and the payload, held at the tip; factor, shear and root of the effects tool_stiffness,
/// tool_shear and tool_root_compliance. At the tip d and r are state.bend_F and state.slope_F.
/// Stations stand where segments meet, of which up to kBendStations - 2 are minded.
///
/// Between stations of a uniform tool r is within 2.5e-4 of the tip's slope: 0.01 mm at 0.5 m
/// beside the axis where the tip moves by 5 % of the length, and less than 0.002 mm where it moves
/// by 1 %.
///
/// The stress is the beam's, by its declared section (beam/stress.h), larger side of a step; 0
/// where the section does not tell its outermost fibre.
///
/// A rigid tool on a yielding seat turns about it; one whose tip does not lie at positive z stays
/// as it is.
/// @param tool   of the cell that `state` comes from
/// @param state  of LoadedArm, converged
BendField BendFieldOf(const Tool& tool, const LoadedState& state);

}  // namespace plumbline
