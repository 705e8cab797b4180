#include "app/vision/lens/projection_uncertainty.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace plumbline::vision {
namespace {

constexpr int kColumns = 13, kRows = 9;
constexpr int kAlignSteps = 5;
constexpr int kCirclePoints = 32;

using LensRows = Eigen::Matrix<double, 2, lens::kLensParameters>;
using Motion = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;

lens::Vec2 GridPixel(int column, int row, image::ImageSize size) {
  return {(size.width - 1) * static_cast<double>(column) / (kColumns - 1),
          (size.height - 1) * static_cast<double>(row) / (kRows - 1)};
}

/// Derivative of the pixel with respect to a small camera rotation and, at a finite distance, a
/// small translation.
Eigen::MatrixXd PixelByMotion(const lens::Lens& lens, const lens::Vec2& n,
                              std::optional<double> distance_m) {
  const double x = n.x(), y = n.y();
  Eigen::Matrix<double, 2, 3> turn;  // of (x, y) with respect to the rotation vector
  turn << -x * y, 1 + x * x, -y, -(1 + y * y), x * y, x;
  const Eigen::Matrix2d D = lens::PixelJacobian(lens, n);
  if (!distance_m) return D * turn;
  Eigen::Matrix<double, 2, 3> shift;
  shift << 1, 0, -x, 0, 1, -y;
  Eigen::Matrix<double, 2, 6> both;
  both << D * turn, D * shift / *distance_m;
  return both;
}

}  // namespace

std::vector<lens::Vec2> PixelsWithin(image::ImageSize size, double radius_px, int columns,
                                     int rows) {
  const lens::Vec2 last(size.width - 1, size.height - 1), middle = 0.5 * last;
  std::vector<lens::Vec2> pixels;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const lens::Vec2 pixel(last.x() * column / (columns - 1), last.y() * row / (rows - 1));
      if ((pixel - middle).norm() <= radius_px) pixels.push_back(pixel);
    }
  }
  for (int k = 0; std::isfinite(radius_px) && k < kCirclePoints; ++k) {
    const double angle = 2 * std::numbers::pi * k / kCirclePoints;
    const lens::Vec2 pixel = middle + radius_px * lens::Vec2(std::cos(angle), std::sin(angle));
    if ((pixel.array() >= 0).all() && (pixel.array() <= last.array()).all())
      pixels.push_back(pixel);
  }
  return pixels;
}

namespace {

/// Derivatives of one pixel for ProjectionUncertaintyOf().
struct PixelPlace {
  bool seen = false;  ///< a direction maps to the pixel: the distortion has not folded back
  LensRows by_lens = LensRows::Zero();
  Eigen::MatrixXd by_motion;
};

PixelPlace PlaceAt(const lens::Lens& lens, const lens::Vec2& pixel,
                   std::optional<double> distance_m) {
  PixelPlace place;
  const auto n = lens::NormalisedOfPixel(lens, pixel);
  place.seen = n.has_value();
  place.by_motion = n ? PixelByMotion(lens, *n, distance_m)
                      : Eigen::MatrixXd(Eigen::MatrixXd::Zero(2, distance_m ? 6 : 3));
  if (n) place.by_lens = lens::PixelByLens(lens, *n);
  return place;
}

}  // namespace

namespace {

/// The places that represent a region, and the motion that compensates a change of the lens there.
struct Region {
  std::vector<PixelPlace> places;
  Eigen::MatrixXd compensated;

  Region(const lens::Lens& lens, image::ImageSize size, std::optional<double> distance_m,
         double radius_px) {
    const int motions = distance_m ? 6 : 3;
    Eigen::MatrixXd square = Eigen::MatrixXd::Zero(motions, motions);
    Eigen::MatrixXd mixed = Eigen::MatrixXd::Zero(motions, static_cast<int>(lens::kLensParameters));
    for (const lens::Vec2& pixel : PixelsWithin(size, radius_px, kColumns, kRows)) {
      const PixelPlace& place = places.emplace_back(PlaceAt(lens, pixel, distance_m));
      square += place.by_motion.transpose() * place.by_motion;
      mixed += place.by_motion.transpose() * place.by_lens;
    }
    compensated = square.ldlt().solve(mixed);
  }
  /// Derivative of e(q) with respect to the lens.
  LensRows ErrorByLens(const PixelPlace& place) const {
    return place.by_lens - place.by_motion * compensated;
  }
};

}  // namespace

ProjectionUncertainty ProjectionUncertaintyOf(const lens::Lens& lens,
                                              const lens::LensCovariance& covariance,
                                              image::ImageSize size,
                                              std::optional<double> distance_m, double radius_px) {
  ProjectionUncertainty result;
  result.distance_m = distance_m;
  result.columns = kColumns;
  result.rows = kRows;
  const Region region(lens, size, distance_m, radius_px);
  const auto deviation = [&](const PixelPlace& place) {
    if (!place.seen) return std::numeric_limits<double>::infinity();
    const LensRows error = region.ErrorByLens(place);
    const Eigen::Matrix2d C = error * covariance * error.transpose();
    const double largest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(C, Eigen::EigenvaluesOnly).eigenvalues()[1];
    return std::sqrt(std::max(0.0, largest));
  };
  for (const PixelPlace& place : region.places)
    result.max_px = std::max(result.max_px, deviation(place));
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const PixelPlace place = PlaceAt(lens, GridPixel(column, row, size), distance_m);
      result.sd_px.push_back(deviation(place));
    }
  }
  return result;
}

lens::LensCovariance ProjectionWeight(const lens::Lens& lens, image::ImageSize size,
                                      std::optional<double> distance_m) {
  const Region region(lens, size, distance_m, INFINITY);
  lens::LensCovariance weight = lens::LensCovariance::Zero();
  for (const PixelPlace& place : region.places) {
    const LensRows error = region.ErrorByLens(place);
    weight += error.transpose() * error;
  }
  return weight / static_cast<double>(region.places.size());
}

double LargestDifference(const lens::Lens& a, const lens::Lens& b, image::ImageSize size,
                         std::optional<double> distance_m, double radius_px) {
  // Gauss-Newton for the camera motion that best aligns b's pixels of a's directions with a's.
  const int motions = distance_m ? 6 : 3;
  std::vector<Vec3> points;
  const std::vector<lens::Vec2> pixels = PixelsWithin(size, radius_px, kColumns, kRows);
  for (const lens::Vec2& pixel : pixels) {
    const auto n = lens::NormalisedOfPixel(a, pixel);
    if (!n) return INFINITY;
    points.emplace_back(Vec3(n->x(), n->y(), 1) * distance_m.value_or(1));
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
      const lens::Vec2 n(p.x() / p.z(), p.y() / p.z());
      const lens::Vec2 error = lens::PixelOfNormalised(b, n) - pixels[k];
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

std::optional<lens::Lens> WithSquarePixels(const lens::Lens& lens,
                                           const lens::LensCovariance& covariance) {
  constexpr double kWithin = 3;     // standard deviations
  constexpr double kTrueTo = 6e-4;  // of sensors and prints
  const double off = lens.fx / lens.fy - 1;
  lens::LensVector g = lens::LensVector::Zero();
  g[0] = 1 / lens.fy;
  g[1] = -lens.fx / (lens.fy * lens.fy);
  const lens::LensVector Cg = covariance * g;
  const double variance = g.dot(Cg);
  if (!(variance > 0) || std::abs(off) <= std::max(kTrueTo, kWithin * std::sqrt(variance)))
    return std::nullopt;
  return lens::LensOfVector(lens::VectorOfLens(lens) - Cg * (off / variance), lens.fisheye);
}

}  // namespace plumbline::vision
