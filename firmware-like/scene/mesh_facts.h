// From the triangles of a file, which may be anything, to a mesh and what is to be known of it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "firmware-like/result.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline {

/// Which way a closed surface's triangles face.
enum class Facing { kOutwards, kInwards, kMixed, kNotClosed };

/// What a mesh amounts to. Vertices at the same place count as one.
struct MeshFacts {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t degenerate = 0;     ///< triangles left out: a repeated corner, or no area
  std::size_t open_edges = 0;     ///< of an odd number of triangles: the surface has a rim there
  std::size_t opposed_edges = 0;  ///< whose triangles face different ways
  std::size_t parts = 0;          ///< that share no vertex
  Vec3 min_O = Vec3::Zero(), max_O = Vec3::Zero();  ///< [m]
  /// Enclosed, negative where the triangles face inwards [m^3]; of a closed surface only.
  ///   V = sum over triangles of a . (b x c) / 6          [divergence theorem]
  double volume_m3 = 0;
  /// Of each of the first kMaxPartsWithEnds parts: its vertices furthest along -x, -y, -z, x, y, z.
  std::vector<std::array<std::uint32_t, 6>> ends;

  static constexpr std::size_t kMaxPartsWithEnds = 16;

  bool closed() const { return triangles > 0 && open_edges == 0; }
  Facing facing() const;
};

struct CheckedMesh {
  TriangleMesh mesh;
  MeshFacts facts;
};

/// Twice the area of a triangle is below this share of its longest edge squared: it has none.
inline constexpr double kNoArea = 1e-7;

/// Scales to metres, joins vertices at exactly the same place, leaves out what no triangle uses and
/// triangles without area; closedness is judged before those are left out.
/// @param raw   in the file's unit; anything
/// @param unit_m  the file's unit [m], > 0
/// @return      refused: no triangle of any area, a corner that is not finite or too large for a
///              float, an index beyond the vertices; each with how many
Result<CheckedMesh> CheckMesh(TriangleMesh raw, double unit_m);

}  // namespace plumbline
