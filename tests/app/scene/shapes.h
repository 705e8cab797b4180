// Meshes with known measures, and as files of every format.
#pragma once

#include <string>

#include "app/scene/mesh_format.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::test {

/// A cuboid about the origin, 12 triangles that face outwards.
TriangleMesh Cuboid(const Vec3f& size);

/// A sphere about the origin: 2 segments (rings - 1) triangles, every vertex at `radius`.
TriangleMesh Sphere(float radius, int rings, int segments);

/// The mesh as a file: .wrl as IndexedFaceSet, binary .stl, .obj, ASCII .ply, glTF with its buffer
/// in it, .glb.
std::string MeshFileText(const TriangleMesh& mesh, MeshFormat format);
std::string StlText(const TriangleMesh& mesh);        ///< the form of STL that is text
std::string BinaryPlyText(const TriangleMesh& mesh);  ///< little-endian

}  // namespace plumbline::test
