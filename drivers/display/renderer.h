// Draws display lists. The only door to the passes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/display/background_pass.h"
#include "drivers/display/flat_pass.h"
#include "drivers/display/gl_context.h"
#include "drivers/display/gl_objects.h"
#include "drivers/display/line_pass.h"
#include "drivers/display/mesh_pass.h"
#include "drivers/display/picture.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline {

enum class DrawResult : std::uint8_t {
  kDrawn,
  kRefused,      ///< this list cannot be drawn: its size, its pinhole, memory; another one may
  kContextLost,  ///< make context and renderer anew and load the meshes again
};

struct RendererOptions {
  std::vector<std::string> font_paths = UsualFontPaths();
};

/// Of one thread, that of its context, which must outlive it. Order: background, meshes, the clip
/// plane's grid, lines, boxes, text.
class Renderer : public DrawnPicture {
 public:
  /// A missing font does not keep the rest from being drawn: see TakeRemarks().
  static Result<std::unique_ptr<Renderer>> Create(GlContext& context,
                                                  const RendererOptions& options = {});
  /// @return  the mesh's number for DrawnMesh, or why it cannot be loaded
  Result<int> LoadMesh(const TriangleMesh& mesh) { return meshes_.Load(mesh); }
  void DropMesh(int mesh) { meshes_.Drop(mesh); }

  /// Draws into a framebuffer of its own. What `list` points to must live until it returns.
  DrawResult Draw(const DisplayList& list);
  /// What the last Draw() that was not kDrawn met.
  const std::string& problem() const { return problem_; }

  ImageSize size() const override { return size_; }
  PictureView ReadRows(int first, int count) override;
  RgbImage ReadBack();

  float TextWidth(const std::string& text, float height_px) {
    return flat_.TextWidth(text, height_px);
  }
  /// See MeshPass. Nothing where the list cannot be drawn.
  std::vector<Vec3f> PlacedVertices(const DisplayList& list, const DrawnMesh& drawn);

  /// What is missing in the pictures since the last call, told once each: the font, a mesh that is
  /// not loaded, the camera's image.
  std::vector<std::string> TakeRemarks();

 private:
  Renderer(GlContext& context, BackgroundPass background, MeshPass meshes, LinePass lines,
           FlatPass flat);
  std::string UnusableIn(const DisplayList& list) const;
  bool Resize(ImageSize size);
  void DrawView(const DisplayList& view, std::size_t place);
  void Remark(const std::string& remark);

  GlContext& context_;
  BackgroundPass background_;
  MeshPass meshes_;
  LinePass lines_;
  FlatPass flat_;
  GlFramebuffer framebuffer_;
  GlRenderbuffer colour_, depth_;
  ImageSize size_;
  std::vector<std::uint8_t> pixels_;
  std::string problem_;
  std::vector<std::string> remarks_, told_;
};

}  // namespace plumbline
