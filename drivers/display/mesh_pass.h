// Render pass for meshes: bending in the vertex shader, lighting, stress colours, clip plane,
// occlusion.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "drivers/display/gl_objects.h"
#include "firmware-like/scene/display_list.h"
#include "firmware-like/scene/triangle_mesh.h"

namespace plumbline::display {

/// For each vertex, in single precision
///   p_C = X_CF B(X_FO (scale stretch p_O)),  B(p) = p + e (BentPoint(bend, p) - p)
/// with the formula of BentPoint() (scene/bend_field.h) and the exaggeration e. Normals rotate with
/// their sections. Light comes from the camera and from above it; back faces are lit as well.
class MeshPass {
 public:
  static constexpr std::size_t kMaxTriangles = 5'000'000;

  static Result<MeshPass> Create();

  /// Uploads a mesh. Fails without triangles, with more than kMaxTriangles, or with an index that
  /// is out of range. @return its number for DrawnMesh
  Result<int> Load(const scene::TriangleMesh& mesh) { return LoadAs(next_++, mesh); }
  void Drop(int mesh) { meshes_.erase(mesh); }
  bool Knows(int mesh) const { return meshes_.contains(mesh); }

  /// Draws occluders, then opaque meshes, then transparent ones in list order. Meshes that are not
  /// loaded, or whose pose is not finite, are skipped.
  void Draw(const scene::DisplayList& list);

  /// Vertices of one mesh in C [m] as transformed by the vertex shader, in the order of its
  /// TriangleMesh, read back from the GPU; a vertex without a triangle is (0, 0, 0).
  std::vector<Vec3f> TransformedVertices(const scene::DisplayList& list,
                                         const scene::DrawnMesh& drawn);

 private:
  struct Loaded {
    GlVertexArray array;
    GlBuffer vertices, indices;
    GLsizei index_count = 0;
    std::size_t vertex_count = 0;  ///< of the original TriangleMesh
    std::vector<std::uint32_t> source;
  };

  Result<int> LoadAs(int number, const scene::TriangleMesh& mesh);
  const GlProgram& ProgramFor(const scene::DisplayList& list, const scene::DrawnMesh& drawn) const;
  void SetUniforms(const GlProgram& program, const scene::DisplayList& list,
                   const scene::DrawnMesh& drawn);
  void DrawOne(const scene::DisplayList& list, const scene::DrawnMesh& drawn);

  std::array<GlProgram, 4> programs_;  ///< bit 0: coloured by stress, bit 1: clipped
  GlTexture stress_colours_;
  std::map<int, Loaded> meshes_;
  int next_ = 1;
};

}  // namespace plumbline::display
