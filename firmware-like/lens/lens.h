// Lens model: pinhole camera with the five distortion coefficients of OpenCV.
//
// Camera frame C: x right, y down, z forward, origin at the centre of projection. Pixel (0, 0) is
// the centre of the top-left pixel.
#pragma once

#include <cmath>
#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline::lens {

template <typename T>
using Vec2Of = Eigen::Matrix<T, 2, 1>;
using Vec2 = Vec2Of<double>;

/// Intrinsics and distortion of a camera at one zoom and one focus setting.
template <typename T>
struct LensOf {
  T fx{0}, fy{0};  ///< focal lengths [px]
  T cx{0}, cy{0};  ///< principal point [px]
  T k1{0}, k2{0};  ///< radial distortion (1)
  T p1{0}, p2{0};  ///< tangential distortion (1)
  T k3{0};         ///< radial distortion, sixth order (1)
};
using Lens = LensOf<double>;

/// Projection of a direction given by its normalised coordinates n = (x, y) = (X/Z, Y/Z):
///   r2 = x^2 + y^2,  c = 1 + k1 r2 + k2 r2^2 + k3 r2^3
///   x' = c x + 2 p1 x y + p2 (r2 + 2 x^2),  y' = c y + p1 (r2 + 2 y^2) + 2 p2 x y
///   u = fx x' + cx,  v = fy y' + cy       [OpenCV; D. C. Brown, Photogramm. Eng. 32 (1966)]
/// Valid inside the image; outside it the distortion polynomial may fold back.
/// @return  pixel [px]
template <typename T>
Vec2Of<T> PixelOfNormalised(const LensOf<T>& lens, const Vec2Of<T>& n) {
  const T x = n.x(), y = n.y();
  const T r2 = x * x + y * y;
  const T radial = T(1) + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const T xd = radial * x + T(2) * lens.p1 * x * y + lens.p2 * (r2 + T(2) * x * x);
  const T yd = radial * y + lens.p1 * (r2 + T(2) * y * y) + T(2) * lens.p2 * x * y;
  return {lens.fx * xd + lens.cx, lens.fy * yd + lens.cy};
}

/// Projection of a point in front of the camera.
/// @param p_CQ  point in the camera frame [m], p_CQ.z() > 0
/// @return      pixel [px]
template <typename T>
Vec2Of<T> Project(const LensOf<T>& lens, const Vec3Of<T>& p_CQ) {
  return PixelOfNormalised<T>(lens, Vec2Of<T>(p_CQ.x() / p_CQ.z(), p_CQ.y() / p_CQ.z()));
}

/// Viewing direction of a pixel: the inverse of PixelOfNormalised, by Newton's method.
/// @return  normalised coordinates (1); nullopt if the distortion polynomial folds back there
std::optional<Vec2> NormalisedOfPixel(const Lens& lens, const Vec2& pixel);

/// Derivative of the pixel with respect to the normalised coordinates [px], shape (2, 2).
Eigen::Matrix2d PixelJacobian(const Lens& lens, const Vec2& n);

}  // namespace plumbline::lens
