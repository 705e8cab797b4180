// Validation of a triangle mesh read from a file, and its properties.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/result.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::scene {

/// Orientation of the triangles of a closed surface.
enum class Facing { kOutwards, kInwards, kMixed, kNotClosed };

/// Properties of a mesh. Vertices at the same position count as one.
struct MeshFacts {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t degenerate = 0;     ///< discarded triangles: repeated corner, or zero area
  std::size_t open_edges = 0;     ///< edges of an odd number of triangles: the surface is open
  std::size_t opposed_edges = 0;  ///< edges whose triangles have opposite orientations
  std::size_t parts = 0;          ///< connected components; they share no vertex
  Vec3 min_O = Vec3::Zero(), max_O = Vec3::Zero();  ///< bounding box [m]
  /// Enclosed volume [m^3]; negative if the triangles face inwards; 0 for an open surface.
  ///   V = sum over triangles of a . (b x c) / 6          [divergence theorem]
  double volume_m3 = 0;
  /// For each of the first kMaxPartsWithEnds parts: the vertices furthest along -x, -y, -z, x, y,
  /// z.
  std::vector<std::array<std::uint32_t, 6>> ends;

  static constexpr std::size_t kMaxPartsWithEnds = 16;

  bool closed() const { return triangles > 0 && open_edges == 0; }
  Facing facing() const;
};

struct CheckedMesh {
  TriangleMesh mesh;
  MeshFacts facts;
};

/// A triangle is degenerate if twice its area is less than this fraction of its longest edge
/// squared.
inline constexpr double kDegenerateArea = 1e-7;

/// Converts a mesh to metres, merges vertices at exactly the same position, and removes unused
/// vertices and triangles without area. Open edges are counted before triangles without area are
/// removed.
/// @param raw     in the unit of the file; not trusted
/// @param unit_m  unit of the file [m], > 0
/// @return        an error, with the number of affected triangles, for an invalid vertex index, a
///                corner that is not finite or too far away, or if no triangle has an area
Result<CheckedMesh> CheckMesh(TriangleMesh raw, double unit_m);

}  // namespace plumbline::scene
