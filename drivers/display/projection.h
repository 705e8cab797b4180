// From the camera frame C to OpenGL's clip space, for pictures whose first row is the top one.
#pragma once

#include <Eigen/Core>

#include "firmware-like/lens/lens.h"

namespace plumbline {

/// What is nearer to the camera than this is not drawn [m]. There is no farthest distance.
inline constexpr float kNearest_m = 0.02F;

/// Clip coordinates of a point in C. With pixel (0, 0) the centre of the top-left pixel and row 0
/// of the framebuffer the top row:
///   x_clip / w = 2 (u + 1/2) / width - 1,  y_clip / w = 2 (v + 1/2) / height - 1,
///   z_clip / w = 1 - 2 nearest / Z,  w = Z
inline Eigen::Matrix4f ClipOfCamera(const Lens& pinhole, ImageSize size) {
  Eigen::Matrix4d P = Eigen::Matrix4d::Zero();
  P(0, 0) = 2 * pinhole.fx / size.width;
  P(0, 2) = 2 * (pinhole.cx + 0.5) / size.width - 1;
  P(1, 1) = 2 * pinhole.fy / size.height;
  P(1, 2) = 2 * (pinhole.cy + 0.5) / size.height - 1;
  P(2, 2) = 1;
  P(2, 3) = -2 * static_cast<double>(kNearest_m);
  P(3, 2) = 1;
  return P.cast<float>();
}

}  // namespace plumbline
