#include "app/vision/lens/disc_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "firmware-like/statistics/median.h"

namespace plumbline::vision {
namespace {

constexpr double kDiscSmooth_px = 1;
constexpr double kRimStart = 0.55;  // of the radius: where the rim zone starts
constexpr double kRimEnd_px = 5;    // beyond the radius, where it ends at the latest
constexpr double kMinRadius_px = 3;
constexpr double kMaxShift = 0.3;  // of the radius: largest correction

struct Centre {
  lens::Vec2 at;
  double width_px;  ///< of the edge, standard deviation, smoothing included
};

/// @param at  of the disc, in `smooth`
std::optional<Centre> RefinedDisc(const cv::Mat& smooth, const Disc& disc, const lens::Vec2& at,
                                  double gap_px) {
  const double longest =
      std::max(disc.RadiusAlong(lens::Vec2::UnitX()), disc.RadiusAlong(lens::Vec2::UnitY()));
  if (longest < kMinRadius_px) return std::nullopt;
  const double radius = 2 * std::sqrt(disc.spread.trace());  // an upper bound of the longer radius
  const double beyond = std::min(kRimEnd_px, 0.5 * gap_px);
  const int reach = static_cast<int>(std::ceil(radius + beyond));
  const int u0 = static_cast<int>(std::lround(at.x())), v0 = static_cast<int>(std::lround(at.y()));
  if (u0 <= reach || v0 <= reach || u0 + reach + 1 >= smooth.cols || v0 + reach + 1 >= smooth.rows)
    return std::nullopt;
  const Eigen::Matrix2d shape = disc.spread.inverse() / 4;  // q^T shape q = 1 on the rim
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  double darkest = 1e9, brightest = -1e9, steepest = 0;
  for (int j = -reach; j <= reach; ++j) {
    const float* above = smooth.ptr<float>(v0 + j - 1) + u0;
    const float* here = smooth.ptr<float>(v0 + j) + u0;
    const float* below = smooth.ptr<float>(v0 + j + 1) + u0;
    for (int i = -reach; i <= reach; ++i) {
      const lens::Vec2 q = lens::Vec2(u0 + i, v0 + j) - at;
      const double share = std::sqrt(q.dot(shape * q));  // 1 on the rim
      if (share < kRimStart || (share - 1) * q.norm() > beyond * share) continue;
      lens::Vec2 n(0.5 * (here[i + 1] - here[i - 1]), 0.5 * (below[i] - above[i]));
      const double g = n.norm();
      darkest = std::min(darkest, static_cast<double>(here[i]));
      brightest = std::max(brightest, static_cast<double>(here[i]));
      steepest = std::max(steepest, g);
      if (!(g > 0)) continue;
      n /= g;
      const double d = n.dot(q) / radius;
      Eigen::Matrix<double, 5, 1> row;
      row << n.x() * n.x(), n.x() * n.y(), n.y() * n.y(), -n.x() * d, -n.y() * d;
      normal += g * g * row * row.transpose();
      right -= g * g * d * d * row;
    }
  }
  const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> solver(normal);
  const Eigen::Matrix<double, 5, 1> conic = solver.solve(right);
  const lens::Vec2 moved = 0.5 * radius * conic.tail<2>();
  if (!moved.allFinite() || !(moved.norm() < kMaxShift * longest)) return std::nullopt;
  return Centre{at + moved, (brightest - darkest) / std::max(2.5066 * steepest, 1e-6)};
}

}  // namespace

void RefineDiscs(const image::LumaView& image, const std::vector<Disc>& discs, double gap_px,
                 BoardView& view) {
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  cv::Mat grey, smooth;
  whole.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, smooth, {0, 0}, kDiscSmooth_px, kDiscSmooth_px, cv::BORDER_REPLICATE);
  std::vector<double> widths;
  for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
    if (!view.seen[k]) continue;
    const auto centre = RefinedDisc(smooth, discs[k], view.corners_px[k], gap_px);
    view.seen[k] = centre.has_value();
    if (!centre) continue;
    view.corners_px[k] = centre->at;
    widths.push_back(centre->width_px);
  }
  if (widths.empty()) return;
  const double width_px = statistics::MedianOf(widths);
  view.blur_px = std::sqrt(std::max(0.0, width_px * width_px - kDiscSmooth_px * kDiscSmooth_px));
}

}  // namespace plumbline::vision
