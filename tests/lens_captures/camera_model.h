// Forward model of a camera and a calibration board for the evaluation of the lens calibration.
// Shares no code with the product.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>

namespace plumbline::lens_captures {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Plane-parallel plate of glass.
struct Plate {
  double thickness_m = 0, index = 1.52;
  Vector3d normal{0, 0, 1};  ///< towards the far side
};

/// Offset [m] between the ray behind the plate and the extension of the ray before it, measured in
/// the plane that is parallel to the plate: t (d' / cos' - d / cos), by Snell's law.
/// @param d  unit vector of the ray before the plate
Vector3d PlateOffset(const Plate& plate, const Vector3d& d);

/// Projection by a perspective lens with OpenCV's rational and thin prism distortion, or by a
/// fisheye (Kannala and Brandt, equidistant).
struct CameraModel {
  double fx = 1700, fy = 1700, cx = 959.5, cy = 539.5;
  bool fisheye = false;
  double k[6] = {0, 0, 0, 0, 0, 0};  ///< k1..k6; of a fisheye the first four
  double p[2] = {0, 0};
  double s[4] = {0, 0, 0, 0};  ///< thin prism
  double skew = 0;             ///< u += skew * (v - cy)
  double tilt = 0;             ///< perspective of a sensor tilted about its vertical [rad]
  Plate pane;                  ///< in front of the lens
  /// Displacement of a pixel by something that is fixed in the image, such as a drop on the glass.
  std::function<Vector2d(const Vector2d&)> field;

  /// Pixel of a direction, for points at infinity.
  Vector2d PixelOfDirection(const Vector3d& d) const;
  /// Pixel of a point in the camera frame, through the pane.
  Vector2d PixelOfPoint(const Vector3d& p_C) const;
};

/// Largest distance over the image between the pixels of equal directions by the true camera and by
/// the stated lens, after the rotation that minimizes the sum of squares [px]; infinite if the
/// stated lens has no direction for a pixel.
/// @param radius_px  pixels farther from the middle of the image do not count
double LargestError(const CameraModel& truth, const CameraModel& stated, int width, int height,
                    double radius_px = 1e9);

}  // namespace plumbline::lens_captures
