// The camera's image behind everything, undistorted pixel by pixel on the GPU.
#pragma once

#include <optional>
#include <vector>

#include "drivers/display/gl_objects.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline {

/// For the centre of each pixel (u, v) of the picture
///   n = ((u - cx) / fx, (v - cy) / fy)             of the picture's pinhole
///   s = PixelOfNormalised(lens, n)                 in the camera's image (lens/lens.h)
/// and the colour is bilinear between the image's pixel centres around s. Where s lies outside the
/// image, or the lens' polynomial has folded back, the picture is dark grey. An image without a
/// lens is fitted into the picture with its own proportions.
class BackgroundPass {
 public:
  static Result<BackgroundPass> Create();

  /// @param place  of the image among those of one picture: each has a texture of its own
  /// @return why the image is not there; the picture has been filled with grey
  Result<void> Draw(const Background& background, const Lens& pinhole, ImageSize size,
                    std::size_t place = 0);

 private:
  struct Image {
    GlTexture texture;
    std::optional<std::uint64_t> sequence;
    ImageSize size;
    bool colour = false;
  };
  static void Load(const Background& background, Image& image);

  GlProgram program_;
  GlVertexArray nothing_;      ///< the corners are computed
  std::vector<Image> images_;  ///< by place
};

/// The square of the largest radius up to which the radial terms of a lens grow with it: beyond,
/// the polynomial folds back. At most 100.
double LargestRadiusSquared(const Lens& lens);

}  // namespace plumbline
