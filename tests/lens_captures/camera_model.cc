#include "tests/lens_captures/camera_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace plumbline::lens_captures {
namespace {

Vector2d PixelOf(const CameraModel& camera, const Vector2d& n) {
  return camera.PixelOfDirection(Vector3d(n.x(), n.y(), 1).normalized());
}

/// Direction of a pixel by Newton's method with numerical derivatives.
bool FindDirection(const CameraModel& camera, const Vector2d& pixel, Vector2d& n) {
  constexpr double kStep = 1e-6;
  n = {(pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy};
  if (const double theta = n.norm(); camera.fisheye && theta > 0) n *= std::tan(theta) / theta;
  for (int pass = 0; pass < 40; ++pass) {
    const Vector2d at = PixelOf(camera, n), error = at - pixel;
    Eigen::Matrix2d J;
    J.col(0) = (PixelOf(camera, n + Vector2d(kStep, 0)) - at) / kStep;
    J.col(1) = (PixelOf(camera, n + Vector2d(0, kStep)) - at) / kStep;
    if (!(J.determinant() > 0)) return false;
    if (error.norm() < 1e-7) return true;
    n -= J.inverse() * error;
  }
  return false;
}

}  // namespace

Vector3d PlateOffset(const Plate& plate, const Vector3d& d) {
  if (plate.thickness_m == 0) return Vector3d::Zero();
  const Vector3d n = plate.normal.normalized();
  const double cosine = d.dot(n);
  const Vector3d across = (d - cosine * n) / plate.index;
  const double inside = std::sqrt(std::max(1e-9, 1 - across.squaredNorm()));
  return plate.thickness_m * ((across + inside * n) / inside - d / cosine);
}

Vector2d CameraModel::PixelOfDirection(const Vector3d& d) const {
  double x = d.x() / d.z(), y = d.y() / d.z();
  double radial = 1;
  double r2 = x * x + y * y;
  if (fisheye) {
    const double across = std::hypot(d.x(), d.y()), theta = std::atan2(across, d.z());
    const double t2 = theta * theta;
    const double bent = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    const double scale = across > 1e-12 ? bent / across : 1 / d.z();
    x = scale * d.x();
    y = scale * d.y();
  } else {
    radial =
        (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))) / (1 + r2 * (k[3] + r2 * (k[4] + r2 * k[5])));
    const double u =
        radial * x + 2 * p[0] * x * y + p[1] * (r2 + 2 * x * x) + s[0] * r2 + s[1] * r2 * r2;
    const double v =
        radial * y + p[0] * (r2 + 2 * y * y) + 2 * p[1] * x * y + s[2] * r2 + s[3] * r2 * r2;
    x = u;
    y = v;
  }
  if (tilt != 0) {
    const double w = 1 + std::tan(tilt) * x;
    x /= w;
    y /= w;
  }
  const double v = fy * y + cy;
  const Vector2d pixel(fx * x + cx + skew * (v - cy), v);
  return field ? Vector2d(pixel + field(pixel)) : pixel;
}

Vector2d CameraModel::PixelOfPoint(const Vector3d& p_C) const {
  Vector3d d = p_C.normalized();
  // A point behind the pane is seen in the direction d with p_C = s d + offset(d).
  for (int pass = 0; pane.thickness_m != 0 && pass < 12; ++pass)
    d = (p_C - PlateOffset(pane, d)).normalized();
  return PixelOfDirection(d);
}

double LargestError(const CameraModel& truth, const CameraModel& stated, int width, int height,
                    double radius_px) {
  constexpr int kColumns = 21, kRows = 15;
  std::vector<Vector3d> directions;
  std::vector<Vector2d> pixels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vector2d pixel((width - 1.0) * column / (kColumns - 1),
                           (height - 1.0) * row / (kRows - 1));
      if ((pixel - Vector2d(width - 1, height - 1) / 2).norm() > radius_px) continue;
      Vector2d n;
      if (!FindDirection(stated, pixel, n)) return INFINITY;
      directions.emplace_back(Vector3d(n.x(), n.y(), 1).normalized());
      pixels.push_back(pixel);
    }
  }
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  double largest = 0;
  for (int pass = 0; pass < 12; ++pass) {
    constexpr double kStep = 1e-6;
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    Vector3d mixed = Vector3d::Zero();
    largest = 0;
    for (std::size_t k = 0; k < pixels.size(); ++k) {
      const Vector3d d = R * directions[k];
      if (!(d.z() > 0.02) && !truth.fisheye) return INFINITY;
      const Vector2d at = truth.PixelOfDirection(d), error = at - pixels[k];
      largest = std::max(largest, error.norm());
      Eigen::Matrix<double, 2, 3> J;
      for (int axis = 0; axis < 3; ++axis) {
        J.col(axis) =
            (truth.PixelOfDirection(d + kStep * Vector3d::Unit(axis).cross(d)) - at) / kStep;
      }
      square += J.transpose() * J;
      mixed += J.transpose() * error;
    }
    const Vector3d w = -square.ldlt().solve(mixed);
    if (!(w.norm() > 1e-10)) break;
    R = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * R;
  }
  return largest;
}

}  // namespace plumbline::lens_captures
