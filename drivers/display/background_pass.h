// Render pass for the background: the camera image, undistorted per pixel on the GPU.
#pragma once

#include <optional>
#include <vector>

#include "drivers/display/gl_objects.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

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

}  // namespace plumbline::display
