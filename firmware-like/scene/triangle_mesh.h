// Triangle mesh, as read from a file.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/geometry/pose.h"

namespace plumbline::scene {

/// Vertex indices, counter-clockwise when seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// Vertices are in the object's frame O [m]. Single precision (0.1 um at 1 m) suffices for display
/// and distance. The readers guarantee that every index is valid and every coordinate is finite.
struct TriangleMesh {
  std::vector<Vec3f> vertices_O;
  std::vector<Triangle> triangles;
};

}  // namespace plumbline::scene
