// Renderer for display lists.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/display/flat_pass.h"
#include "drivers/display/gl_context.h"
#include "drivers/display/gl_objects.h"
#include "drivers/display/line_pass.h"
#include "drivers/display/mesh_pass.h"
#include "drivers/display/picture.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

// Render pass for the background: the camera image, undistorted per pixel on the GPU.

/// For the centre of each pixel (u, v) of the picture
///   n = ((u - cx) / fx, (v - cy) / fy)             with the pinhole of the picture
///   s = PixelOfNormalised(lens, n)                 in the camera image (lens/lens.h)
/// and the colour is interpolated bilinearly between the pixel centres around s. If s lies outside
/// the image, or the lens polynomial has folded back, the pixel is dark grey. An image without a
/// lens is scaled to fit into the picture, keeping its aspect ratio.
class BackgroundPass {
 public:
  static Result<BackgroundPass> Create();

  /// @param view  index of the camera view in the picture; each has its own texture
  /// @return an error if there is no image; the background is then grey
  Result<void> Draw(const scene::Background& background, const lens::Lens& pinhole,
                    image::ImageSize size, std::size_t view = 0);

 private:
  struct Image {
    GlTexture texture;
    std::optional<std::uint64_t> sequence;
    image::ImageSize size;
    bool colour = false;
  };
  static void Load(const scene::Background& background, Image& image);

  GlProgram program_;
  GlVertexArray empty_array_;  ///< the vertex shader computes the corners
  std::vector<Image> images_;  ///< by view
};

/// Square of the largest normalised radius up to which the distorted radius increases; beyond it
/// the polynomial folds back. At most 100.
double LargestRadiusSquared(const lens::Lens& lens);

enum class DrawResult : std::uint8_t {
  kDrawn,
  kRefused,      ///< this list cannot be drawn (size, pinhole or memory); another one may be
  kContextLost,  ///< recreate context and renderer and load the meshes again
};

struct RendererOptions {
  std::vector<std::string> font_paths = DefaultFontPaths();
};

/// Must be used on the thread of its context; the context must outlive the renderer. Drawing order:
/// background, meshes, clip plane grid, lines, boxes, strokes, text.
class Renderer : public DrawnPicture {
 public:
  /// Creates the renderer. Without a font everything except text is drawn, see TakeRemarks().
  static Result<std::unique_ptr<Renderer>> Create(GlContext& context,
                                                  const RendererOptions& options = {});
  /// @return  the number of the mesh for DrawnMesh, or why it cannot be loaded
  Result<int> LoadMesh(const scene::TriangleMesh& mesh) { return meshes_.Load(mesh); }
  void DropMesh(int mesh) { meshes_.Drop(mesh); }

  /// Draws into an internal framebuffer. Everything `list` points to must live until Draw()
  /// returns.
  DrawResult Draw(const scene::DisplayList& list);
  /// Error of the last Draw() that did not return kDrawn.
  const std::string& problem() const { return problem_; }

  image::ImageSize size() const override { return size_; }
  PictureView ReadRows(int first, int count) override;
  RgbImage ReadBack();

  float TextWidth(const std::string& text, float height_px) {
    return flat_.TextWidth(text, height_px);
  }
  /// See MeshPass. Empty if the list cannot be drawn.
  std::vector<Vec3f> TransformedVertices(const scene::DisplayList& list,
                                         const scene::DrawnMesh& drawn);

  /// Warnings since the last call about parts that are missing in the pictures: the font, a mesh
  /// that is not loaded, the camera image. Each is reported once.
  std::vector<std::string> TakeRemarks();

 private:
  Renderer(GlContext& context, BackgroundPass background, MeshPass meshes, LinePass lines,
           FlatPass flat);
  std::string CheckList(const scene::DisplayList& list) const;
  bool Resize(image::ImageSize size);
  void DrawView(const scene::DisplayList& view, std::size_t index);
  void Remark(const std::string& remark);

  GlContext& context_;
  BackgroundPass background_;
  MeshPass meshes_;
  LinePass lines_;
  FlatPass flat_;
  GlFramebuffer framebuffer_;
  GlRenderbuffer colour_, depth_;
  image::ImageSize size_;
  std::vector<std::uint8_t> pixels_;
  std::string problem_;
  std::vector<std::string> remarks_, reported_;
};

}  // namespace plumbline::display
