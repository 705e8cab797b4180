// A surface of triangles, as read from a file.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

using Triangle = std::array<std::uint32_t, 3>;  ///< indices of vertices, counter-clockwise seen
                                                ///< from outside

/// Vertices in the object's own frame O [m]; single precision serves a display and a distance:
/// 0.1 um at 1 m. Every index is below the number of vertices and every coordinate is finite: the
/// readers see to it.
struct TriangleMesh {
  std::vector<Vec3f> vertices_O;
  std::vector<Triangle> triangles;
};

}  // namespace plumbline
