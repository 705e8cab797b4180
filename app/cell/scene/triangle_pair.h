// Intersection tests of two triangles.
#pragma once

#include <array>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline::cell {

using Corners = std::array<Vec3, 3>;

/// Whether two triangles intersect, by the separating axis theorem. Axes: both normals, the cross
/// products of the edges of one with those of the other and, for coplanar triangles, of each edge
/// with its normal.                                                      [Gottschalk et al. 1996]
bool TrianglesCross(const Corners& a, const Corners& b);

/// Position along its path at which a moving triangle a separates from triangle b.
struct TriangleExit {
  double way_m = 0;            ///< the triangles intersect up to here and not beyond
  Vec3 normal = Vec3::Zero();  ///< separating axis at the exit, not normalised
};

/// Travel of a along a unit vector until it leaves b: the smallest one at which an axis separates
/// them. Only for triangles that intersect.
TriangleExit ExitOf(const Corners& a, const Corners& b, const Vec3& along);

/// Centre of the intersection segment of two triangles; nullopt if they are coplanar.
std::optional<Vec3> MiddleOfCrossing(const Corners& a, const Corners& b);

}  // namespace plumbline::cell
