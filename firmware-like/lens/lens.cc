#include "firmware-like/lens/lens.h"

namespace plumbline::lens {
namespace {

constexpr int kMostSteps = 20;
constexpr double kConverged_px = 1e-9;
constexpr double kMostTheta_rad = 1.5;  // of a fisheye: n is finite below pi/2

}  // namespace

namespace {

/// Values of the radial factor that the derivatives share.
struct Radial {
  double factor = 1;  ///< of (x, y)
  double slope = 0;   ///< d factor / d r^2
};

/// theta (1 + k1 theta^2 + ..) / r and its derivative with respect to r^2.
Radial FisheyeRadial(const Lens& lens, double r2) {
  if (!(r2 > 1e-12)) return {1, lens.k1 - 1.0 / 3};
  const double r = std::sqrt(r2), theta = std::atan(r), t2 = theta * theta;
  const double bent = theta * (1 + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4))));
  const double by_theta =
      1 + t2 * (3 * lens.k1 + t2 * (5 * lens.k2 + t2 * (7 * lens.k3 + t2 * 9 * lens.k4)));
  return {bent / r, (by_theta / (1 + r2) - bent / r) / (2 * r2)};
}

Radial RationalRadial(const Lens& lens, double r2) {
  const double above = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double below = 1 + r2 * (lens.k4 + r2 * (lens.k5 + r2 * lens.k6));
  const double above_slope = lens.k1 + r2 * (2 * lens.k2 + 3 * r2 * lens.k3);
  const double below_slope = lens.k4 + r2 * (2 * lens.k5 + 3 * r2 * lens.k6);
  return {above / below, (above_slope - above / below * below_slope) / below};
}

}  // namespace

Eigen::Matrix2d PixelJacobian(const Lens& lens, const Vec2& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const Radial radial = lens.fisheye ? FisheyeRadial(lens, r2) : RationalRadial(lens, r2);
  const double cross = 2 * x * y * radial.slope;
  Eigen::Matrix2d J;
  J << radial.factor + 2 * x * x * radial.slope, cross, cross,
      radial.factor + 2 * y * y * radial.slope;
  if (!lens.fisheye) {
    const double tangential = 2 * lens.p1 * x + 2 * lens.p2 * y;
    const double prism_u = 2 * (lens.s1 + 2 * r2 * lens.s2);
    const double prism_v = 2 * (lens.s3 + 2 * r2 * lens.s4);
    J(0, 0) += 2 * lens.p1 * y + 6 * lens.p2 * x + prism_u * x;
    J(0, 1) += tangential + prism_u * y;
    J(1, 0) += tangential + prism_v * x;
    J(1, 1) += 6 * lens.p1 * y + 2 * lens.p2 * x + prism_v * y;
  }
  J.row(0) *= lens.fx;
  J.row(1) *= lens.fy;
  return J;
}

std::optional<Vec2> NormalisedOfPixel(const Lens& lens, const Vec2& pixel) {
  Vec2 n((pixel.x() - lens.cx) / lens.fx, (pixel.y() - lens.cy) / lens.fy);
  if (lens.fisheye) {
    // Without the coefficients theta is the distorted radius.
    const double theta = n.norm();
    if (!(theta < kMostTheta_rad)) return std::nullopt;
    if (theta > 0) n *= std::tan(theta) / theta;
  }
  for (int step = 0; step < kMostSteps; ++step) {
    const Vec2 error = PixelOfNormalised(lens, n) - pixel;
    const Eigen::Matrix2d J = PixelJacobian(lens, n);
    if (!(J.determinant() > 0)) return std::nullopt;
    if (error.norm() < kConverged_px) return n;
    n -= J.inverse() * error;
  }
  return std::nullopt;
}

}  // namespace plumbline::lens
