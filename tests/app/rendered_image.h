// Rendered images and the cameras that took them, as values of the product.
#pragma once

#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"
#include "tests/renderer/scene.h"

namespace plumbline::test {

inline lens::Lens LensOfCamera(const renderer::Camera& c) {
  return {c.fx,
          c.fy,
          c.cx,
          c.cy,
          c.distortion[0],
          c.distortion[1],
          c.distortion[2],
          c.distortion[3],
          c.distortion[4]};
}

inline image::LumaView ViewOf(const renderer::Image& image) {
  return {image.grey.data(), image.width, image.height, image.width};
}

}  // namespace plumbline::test
