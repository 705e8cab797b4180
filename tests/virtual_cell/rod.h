// Geometrically exact rod model of the tool: large displacements and rotations, small strains.
//
// Along the arc length s, in the frame of the clamped root:
//   r' = R (e3 + gamma),  R' = R [kappa],  n' = -w,  m' = -r' x n
//   kappa = diag(EIx, EIy, GJ)^-1 R' m,  gamma = diag(kGA, kGA, EA)^-1 R' n
// [Reissner 1981; Simo 1985]. Without shear gamma = 0 (Kirchhoff's inextensible rod). n is the
// force and m the moment that the part beyond s exerts on the part before.
#pragma once

#include <vector>

#include "tests/virtual_cell/cell_description.h"

namespace virtual_cell {

/// Loads on the rod; all are dead loads acting on the deformed shape.
struct RodLoad {
  Vec3 gravity = Vec3::Zero();     ///< in the root frame [m/s^2]; times weight_kg_m along the rod
  Vec3 tip_force = Vec3::Zero();   ///< in the root frame [N]
  Vec3 tip_offset = Vec3::Zero();  ///< point of application in the *tip* frame [m]
};

struct RodOptions {
  double bending_factor = 1;  ///< EI is multiplied by this
  double shear_factor = 0;    ///< k of k G A; 0: no shear, no extension
  int steps = 48;             ///< Runge-Kutta steps over the whole length
};

struct RodShape {
  Motion tip = Motion::Identity();  ///< tip frame in the root frame
  Vec3 root_force = Vec3::Zero();   ///< force exerted by the rod on its root [N]
  Vec3 root_moment = Vec3::Zero();  ///< about the root [N m]
  bool converged = false;
};

/// Shooting on the root moment, Runge-Kutta of fourth order along s, Newton on
///   m(L) = (R(L) tip_offset) x tip_force,
/// in as many load steps as required. @param guess  initial root moment
RodShape SolveRod(const std::vector<RodSegment>& segments, const RodLoad& load,
                  const RodOptions& options = {}, const Vec3& guess = Vec3::Zero());

}  // namespace virtual_cell
