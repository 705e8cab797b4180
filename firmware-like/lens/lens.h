// Lens model: pinhole camera with the distortion coefficients of OpenCV, or a fisheye.
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
  /// Denominator of the rational model (1); of a fisheye, k4 is the coefficient of theta^8.
  T k4{0}, k5{0}, k6{0};
  T s1{0}, s2{0}, s3{0}, s4{0};  ///< thin prism (1)
  bool fisheye = false;          ///< k1..k4 are those of a fisheye; the others are zero
};
using Lens = LensOf<double>;

/// Image of a direction before scaling by the focal length, from its normalised coordinates
/// n = (x, y) = (X/Z, Y/Z):
///   r2 = x^2 + y^2,  c = (1 + k1 r2 + k2 r2^2 + k3 r2^3) / (1 + k4 r2 + k5 r2^2 + k6 r2^3)
///   x' = c x + 2 p1 x y + p2 (r2 + 2 x^2) + s1 r2 + s2 r2^2
///   y' = c y + p1 (r2 + 2 y^2) + 2 p2 x y + s3 r2 + s4 r2^2
/// [OpenCV; D. C. Brown, Photogramm. Eng. 32 (1966); thin prism: J. Weng et al., PAMI 14 (1992)
/// 965]. A fisheye:
///   theta = atan r,  (x', y') = theta (1 + k1 theta^2 + .. + k4 theta^8) (x, y) / r
/// [J. Kannala and S. Brandt, PAMI 28 (2006) 1335, as in OpenCV].
template <typename T>
Vec2Of<T> DistortedNormalised(const LensOf<T>& lens, const Vec2Of<T>& n) {
  const T x = n.x(), y = n.y();
  const T r2 = x * x + y * y;
  if (lens.fisheye) {
    using std::atan;
    using std::sqrt;
    if (!(r2 > T(1e-12))) return n;
    const T r = sqrt(r2), theta = atan(r), t2 = theta * theta;
    const T bent = theta * (T(1) + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4))));
    return n * (bent / r);
  }
  const T radial = (T(1) + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))) /
                   (T(1) + r2 * (lens.k4 + r2 * (lens.k5 + r2 * lens.k6)));
  return {radial * x + T(2) * lens.p1 * x * y + lens.p2 * (r2 + T(2) * x * x) +
              r2 * (lens.s1 + r2 * lens.s2),
          radial * y + lens.p1 * (r2 + T(2) * y * y) + T(2) * lens.p2 * x * y +
              r2 * (lens.s3 + r2 * lens.s4)};
}

/// Projection of a direction: u = fx x' + cx, v = fy y' + cy (DistortedNormalised). Valid inside
/// the image; outside it the distortion polynomial may fold back.
/// @return  pixel [px]
template <typename T>
Vec2Of<T> PixelOfNormalised(const LensOf<T>& lens, const Vec2Of<T>& n) {
  const Vec2Of<T> d = DistortedNormalised<T>(lens, n);
  return {lens.fx * d.x() + lens.cx, lens.fy * d.y() + lens.cy};
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
