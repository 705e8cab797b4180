// Two triangles.
#pragma once

#include <array>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

using Corners = std::array<Vec3, 3>;

/// Whether they have a point in common, by the axes on which two triangles can be apart: the
/// normals, each edge of one crossed with each of the other, and for triangles in one plane each
/// edge crossed with its normal.                          [Gottschalk et al. 1996, separating axes]
bool TrianglesCross(const Corners& a, const Corners& b);

/// Where a, moved on, leaves b.
struct TriangleExit {
  double way_m = 0;            ///< both have a point in common up to here, and none beyond
  Vec3 normal = Vec3::Zero();  ///< of the surface through what touches last, not normalised
};

/// How far a must go along a unit vector until it leaves b: the smallest way on which some axis of
/// the above sees both apart. Only for triangles that cross.
TriangleExit ExitOf(const Corners& a, const Corners& b, const Vec3& along);

/// The middle of the line that two triangles have in common; nothing where they lie in one plane.
std::optional<Vec3> MiddleOfCrossing(const Corners& a, const Corners& b);

}  // namespace plumbline
