// Penetration depth of two meshes: travel of one until it no longer touches the other.
#pragma once

#include <vector>

#include "app/display/scene/mesh_pair.h"

namespace plumbline::display {

/// Whether a part of one mesh is inside the other. Requires that their surfaces do not cross.
bool EitherContainsOther(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB);

/// Depth and direction, as defined for Separation (interference.h).
struct Penetration {
  double depth_m = 0;
  Vec3 direction_A = Vec3::Zero();
};

/// Tests positions along the initial direction and opposite to it with growing strides, then
/// bisects between the last that touches and the first that is free. Intersecting triangles are
/// known to intersect up to their exit (ExitOf), so positions before that are not tested.
/// @param crossing  the intersecting triangles; empty if one mesh is inside the other
/// @param initial_direction_A   a unit vector
/// @param step_m    resolution of the depth
Penetration PenetrationOf(const BvhSolid& a, const BvhSolid& b, const Pose& X_AB,
                          const std::vector<TrianglePair>& crossing,
                          const Vec3& initial_direction_A, double step_m);

}  // namespace plumbline::display
