// Bend field of a cell's loaded tool, effects included.
#pragma once

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline::scene {

/// Accelerations of the flange in F, by d'Alembert loads on the tool.
struct FlangeAcceleration {
  Vec3 linear_F = Vec3::Zero();   ///< [m/s^2]
  Vec3 angular_F = Vec3::Zero();  ///< [rad/s^2]
};

/// Computes displacement and rotation of every section of the loaded tool:
///   d(z) = factor d_beam(z) + shear F integral_0^z ds / (G A) + root x (0, 0, z)
///   r(z) = factor r_beam(z) + root
/// d_beam and r_beam come from the finite elements of the declared beam (beam/beam.h) under its own
/// weight and the payload attached to the tip; factor, shear and root from the effects
/// tool_stiffness, tool_shear and tool_root_compliance. At the tip, d and r equal state.bend_F and
/// state.slope_F. Stations are placed where segments meet, for up to kBendStations - 2 joints
/// between segments.
///
/// Between the stations of a uniform tool, the error of r is below 2.5e-4 of the tip slope. At a
/// point 0.5 m from the axis this is 0.01 mm for a tip displacement of 5 % of the length, and less
/// than 0.002 mm for 1 %.
///
/// The stress is that of the beam with its declared sections (beam/beam.h), the larger value at a
/// step; 0 if the outermost fibre of the section is unknown.
///
/// A rigid tool on a compliant coupling rotates about the coupling; there is no effect if its tip
/// is not at z > 0.
/// @param tool     tool of the cell that `state` belongs to
/// @param state    converged state from LoadedArm
/// @param inertia  accelerations of the flange, which load the tool in addition to gravity, but not
///                 the flange coupling
BendField BendFieldOf(const model::Tool& tool, const deflection::LoadedState& state,
                      const FlangeAcceleration& inertia = {});

}  // namespace plumbline::scene
