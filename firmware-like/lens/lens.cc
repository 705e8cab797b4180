#include "firmware-like/lens/lens.h"

namespace plumbline::lens {
namespace {

constexpr int kMostSteps = 20;
constexpr double kConverged_px = 1e-9;

}  // namespace

Eigen::Matrix2d PixelJacobian(const Lens& lens, const Vec2& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double slope = lens.k1 + r2 * (2 * lens.k2 + 3 * r2 * lens.k3);  // d radial / d r2
  const double cross = 2 * x * y * slope + 2 * lens.p1 * x + 2 * lens.p2 * y;
  Eigen::Matrix2d J;
  J << radial + 2 * x * x * slope + 2 * lens.p1 * y + 6 * lens.p2 * x, cross, cross,
      radial + 2 * y * y * slope + 6 * lens.p1 * y + 2 * lens.p2 * x;
  J.row(0) *= lens.fx;
  J.row(1) *= lens.fy;
  return J;
}

std::optional<Vec2> NormalisedOfPixel(const Lens& lens, const Vec2& pixel) {
  Vec2 n((pixel.x() - lens.cx) / lens.fx, (pixel.y() - lens.cy) / lens.fy);
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
