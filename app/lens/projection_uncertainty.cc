#include "app/lens/projection_uncertainty.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace plumbline::lens {
namespace {

constexpr int kColumns = 13, kRows = 9;
constexpr int kAlignSteps = 5;

using LensRows = Eigen::Matrix<double, 2, kLensCount>;
using Motion = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;

Vec2 GridPixel(int column, int row, image::ImageSize size) {
  return {(size.width - 1) * static_cast<double>(column) / (kColumns - 1),
          (size.height - 1) * static_cast<double>(row) / (kRows - 1)};
}

LensRows PixelByLensAt(const Lens& lens, const Vec2& n) {
  const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
  const Vec2 pixel = PixelOfNormalised(lens, n);
  const Vec2 fxy(lens.fx * x, lens.fy * y);
  LensRows J = LensRows::Zero();
  J(0, kFx) = (pixel.x() - lens.cx) / lens.fx;
  J(1, kFy) = (pixel.y() - lens.cy) / lens.fy;
  J(0, kCx) = J(1, kCy) = 1;
  J.col(kK1) = fxy * r2;
  J.col(kK2) = fxy * (r2 * r2);
  J.col(kK3) = fxy * (r2 * r2 * r2);
  J.col(kP1) << lens.fx * 2 * x * y, lens.fy * (r2 + 2 * y * y);
  J.col(kP2) << lens.fx * (r2 + 2 * x * x), lens.fy * 2 * x * y;
  return J;
}

/// Derivative of the pixel with respect to a small camera rotation and, at a finite distance, a
/// small translation.
Eigen::MatrixXd PixelByMotion(const Lens& lens, const Vec2& n, std::optional<double> distance_m) {
  const double x = n.x(), y = n.y();
  Eigen::Matrix<double, 2, 3> turn;  // of (x, y) with respect to the rotation vector
  turn << -x * y, 1 + x * x, -y, -(1 + y * y), x * y, x;
  const Eigen::Matrix2d D = PixelJacobian(lens, n);
  if (!distance_m) return D * turn;
  Eigen::Matrix<double, 2, 3> shift;
  shift << 1, 0, -x, 0, 1, -y;
  Eigen::Matrix<double, 2, 6> both;
  both << D * turn, D * shift / *distance_m;
  return both;
}

}  // namespace

ProjectionUncertainty ProjectionUncertaintyOf(const Lens& lens, const LensMatrix& covariance,
                                              image::ImageSize size,
                                              std::optional<double> distance_m) {
  ProjectionUncertainty result;
  result.distance_m = distance_m;
  result.columns = kColumns;
  result.rows = kRows;
  const int motions = distance_m ? 6 : 3;
  std::vector<LensRows> by_lens;
  std::vector<Eigen::MatrixXd> by_motion;
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(motions, motions);
  Eigen::MatrixXd mixed = Eigen::MatrixXd::Zero(motions, static_cast<int>(kLensCount));
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto n = NormalisedOfPixel(lens, GridPixel(column, row, size));
      // No direction maps to this pixel: the distortion polynomial has folded back.
      by_lens.push_back(n ? PixelByLensAt(lens, *n) : LensRows(LensRows::Zero()));
      by_motion.push_back(n ? PixelByMotion(lens, *n, distance_m)
                            : Eigen::MatrixXd::Zero(2, motions));
      square += by_motion.back().transpose() * by_motion.back();
      mixed += by_motion.back().transpose() * by_lens.back();
      if (!n) result.max_px = INFINITY;
    }
  }
  const Eigen::MatrixXd compensated = square.ldlt().solve(mixed);
  for (std::size_t k = 0; k < by_lens.size(); ++k) {
    const LensRows error = by_lens[k] - by_motion[k] * compensated;
    const Eigen::Matrix2d C = error * covariance * error.transpose();
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(C, Eigen::EigenvaluesOnly).eigenvalues()[1];
    result.sd_px.push_back(std::sqrt(std::max(0.0, largest)));
    result.max_px = std::max(result.max_px, result.sd_px.back());
  }
  return result;
}

double LargestDifference(const Lens& a, const Lens& b, image::ImageSize size,
                         std::optional<double> distance_m) {
  // Gauss-Newton for the camera motion that best aligns b's pixels of a's directions with a's.
  const int motions = distance_m ? 6 : 3;
  std::vector<Vec3> points;
  std::vector<Vec2> pixels;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vec2 pixel = GridPixel(column, row, size);
      const auto n = NormalisedOfPixel(a, pixel);
      if (!n) return INFINITY;
      points.emplace_back(Vec3(n->x(), n->y(), 1) * distance_m.value_or(1));
      pixels.push_back(pixel);
    }
  }
  Pose motion;
  double largest = 0;
  for (int step = 0; step <= kAlignSteps; ++step) {
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(motions, motions);
    Eigen::VectorXd mixed = Eigen::VectorXd::Zero(motions);
    largest = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Vec3 p = motion * points[k];
      if (!(p.z() > 0)) return INFINITY;
      const Vec2 n(p.x() / p.z(), p.y() / p.z());
      const Vec2 error = PixelOfNormalised(b, n) - pixels[k];
      largest = std::max(largest, error.norm());
      const Eigen::MatrixXd D = PixelByMotion(b, n, distance_m);
      square += D.transpose() * D;
      mixed += D.transpose() * error;
    }
    const Eigen::VectorXd change = -square.ldlt().solve(mixed);
    const Vec3 w = change.head<3>();
    const double angle = w.norm();
    Pose moved;
    if (angle > 0) moved.R = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
    if (distance_m) moved.p = change.tail<3>();
    motion = moved * motion;
  }
  return largest;
}

}  // namespace plumbline::lens
