#include "app/vision/tracking/corner_refinement.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "app/vision/tracking/edge_fit.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {
namespace {

/// Outward deflection of the image of a straight side at its middle [px].
double BowAtMiddle(const lens::Lens& lens, const lens::Vec2& from, const lens::Vec2& to,
                   const lens::Vec2& normal) {
  const auto a = lens::NormalisedOfPixel(lens, from), b = lens::NormalisedOfPixel(lens, to);
  if (!a || !b) return 0;
  // Evaluated near the middle, where a displacement along the side does not matter.
  return normal.dot(lens::PixelOfNormalised<double>(lens, 0.5 * (*a + *b)) - 0.5 * (from + to));
}

}  // namespace

std::optional<RefinedCorners> RefineCorners(const image::LumaView& image, const Corners& rough,
                                            const std::array<HiddenParts, 4>& hidden, int cells,
                                            const lens::Lens* lens) {
  std::array<EdgeFit, 4> fits;
  std::array<lens::Vec2, 4> direction, normal;
  std::array<double, 4> length{};
  RefinedCorners refined;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const lens::Vec2 side = rough[(k + 1) % 4] - rough[k];
    length[k] = side.norm();
    if (!(length[k] > 4)) return std::nullopt;
    direction[k] = side / length[k];
    normal[k] = lens::Vec2(direction[k].y(), -direction[k].x());
  }
  for (Eigen::Index k = 0; k < 4; ++k) {
    // Cell size across this side, at the narrower end of the tag.
    const double across = std::min(-normal[k].dot(rough[(k + 2) % 4] - rough[k]),
                                   -normal[k].dot(rough[(k + 3) % 4] - rough[k]));
    EdgeRegion region{
        rough[k], rough[(k + 1) % 4], normal[(k + 3) % 4], normal[(k + 1) % 4], across / cells,
        0,        hidden[k]};
    if (lens != nullptr) {
      region.bow_px = BowAtMiddle(*lens, rough[k], rough[(k + 1) % 4], normal[k]);
    }
    const auto fit = FitEdge(image, region);
    if (!fit) return std::nullopt;
    fits[k] = *fit;
    refined.blur_px += 0.25 * fit->blur_px;
  }
  refined.covariance.setZero();
  for (Eigen::Index k = 0; k < 4; ++k) {
    // n . x = d0 + (d1 - d0) s for both sides, with x relative to the rough corner:
    // s = 1 + t . x / length at the end of the previous side, s = t . x / length at the start of
    // the next side.
    const Eigen::Index before = (k + 3) % 4;
    const EdgeFit &b = fits[before], &a = fits[k];
    Eigen::Matrix2d N;
    N.row(0) = normal[before] - (b.d1 - b.d0) / length[before] * direction[before];
    N.row(1) = normal[k] - (a.d1 - a.d0) / length[k] * direction[k];
    if (std::abs(N.determinant()) < 0.1) return std::nullopt;
    const Eigen::Matrix2d inverse = N.inverse();
    refined.corners[k] = rough[k] + inverse * lens::Vec2(b.d1, a.d0);
    // The end of side k determines corner k + 1, its start corner k.
    const lens::Vec2 by_start = inverse.col(1), by_end_of_before = inverse.col(0);
    const Eigen::Index next = (k + 1) % 4;
    refined.covariance.block<2, 2>(2 * k, 2 * k) +=
        by_start * a.covariance(0, 0) * by_start.transpose() +
        by_end_of_before * b.covariance(1, 1) * by_end_of_before.transpose();
    Eigen::Matrix2d N_next;
    N_next.row(0) = normal[k] - (a.d1 - a.d0) / length[k] * direction[k];
    N_next.row(1) = normal[next] - (fits[next].d1 - fits[next].d0) / length[next] * direction[next];
    const lens::Vec2 by_end = N_next.inverse().col(0);
    const Eigen::Matrix2d shared = by_start * a.covariance(0, 1) * by_end.transpose();
    refined.covariance.block<2, 2>(2 * k, 2 * next) += shared;
    refined.covariance.block<2, 2>(2 * next, 2 * k) += shared.transpose();
  }
  return refined;
}

}  // namespace plumbline::vision
