// Vertex normals of a mesh, for lighting.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::display {

/// Vertex in the layout used by the GPU.
struct LitVertex {
  Vec3f p_O = Vec3f::Zero();
  std::array<std::int16_t, 4> n_O = {};  ///< unit normal times 32767; fourth component 0
};

/// Mesh with one normal per vertex: a vertex on a crease occurs once for each side.
struct LitMesh {
  std::vector<LitVertex> vertices;
  std::vector<std::uint32_t> source;  ///< index of the original vertex, per vertex
  std::vector<scene::Triangle> triangles;
};

/// Computes area-weighted normals that are smooth where neighbouring triangles meet at less than 40
/// degrees and split at sharper edges. Vertices with identical coordinates count as one, as STL
/// files require. If more than 64 triangles share a vertex each keeps its own normal. A degenerate
/// triangle gets the normal z; it is not visible.
LitMesh ComputeNormals(const scene::TriangleMesh& mesh);

}  // namespace plumbline::display
