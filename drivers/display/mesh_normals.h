// The normals of a mesh, for lighting.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline {

/// A vertex as the GPU gets it.
struct LitVertex {
  Vec3f p_O = Vec3f::Zero();
  std::array<std::int16_t, 4> n_O = {};  ///< unit normal times 32767, then 0
};

/// Vertices with one normal each: a vertex of an edge occurs once for each side of it.
struct LitMesh {
  std::vector<LitVertex> vertices;
  std::vector<std::uint32_t> source;  ///< the mesh's vertex that each one is
  std::vector<Triangle> triangles;
};

/// Normals that run smoothly where neighbouring triangles meet at less than 40 degrees, and break
/// at sharper edges; weighted by area. Vertices at the very same place count as one, as STL files
/// need it. Where more than 64 triangles meet each keeps its own normal. A triangle without area
/// has the normal z, and is not seen.
LitMesh WithNormals(const TriangleMesh& mesh);

}  // namespace plumbline
