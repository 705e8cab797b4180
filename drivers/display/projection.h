// Projection from the camera frame C to OpenGL clip space, for pictures stored top row first.
#pragma once

#include <Eigen/Core>

#include "firmware-like/image/image_size.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::display {

/// Distance of the near plane [m]. There is no far plane.
inline constexpr float kNearPlane_m = 0.02F;

/// Projection matrix from C to clip coordinates. Pixel (0, 0) is the centre of the top-left pixel,
/// and row 0 of the framebuffer is the top row:
///   x_clip / w = 2 (u + 1/2) / width - 1,  y_clip / w = 2 (v + 1/2) / height - 1,
///   z_clip / w = 1 - 2 nearest / Z,  w = Z
inline Eigen::Matrix4f ClipOfCamera(const lens::Lens& pinhole, image::ImageSize size) {
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 2 * pinhole.fx / size.width;
  P(0, 2) = 2 * (pinhole.cx + 0.5) / size.width - 1;
  P(1, 1) = 2 * pinhole.fy / size.height;
  P(1, 2) = 2 * (pinhole.cy + 0.5) / size.height - 1;
  P(2, 2) = 1;
  P(2, 3) = -2 * static_cast<double>(kNearPlane_m);
  P(3, 2) = 1;
  return P.cast<float>();
}

}  // namespace plumbline::display
