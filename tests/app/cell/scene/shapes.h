// Meshes of known geometry, also as files of every format.
#pragma once

#include <string>

#include "app/cell/scene/mesh_format.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::test {

/// A cuboid centred at the origin, 12 triangles facing outwards.
scene::TriangleMesh Cuboid(const Vec3f& size);

/// A sphere centred at the origin: 2 segments (rings - 1) triangles, all vertices at `radius`.
scene::TriangleMesh Sphere(float radius, int rings, int segments);

/// The mesh as a file: .wrl with an IndexedFaceSet, binary .stl, .obj, ASCII .ply, .gltf with an
/// embedded buffer, .glb.
std::string MeshFileText(const scene::TriangleMesh& mesh, cell::MeshFormat format);
std::string StlText(const scene::TriangleMesh& mesh);        ///< text STL
std::string BinaryPlyText(const scene::TriangleMesh& mesh);  ///< little-endian

}  // namespace plumbline::test
