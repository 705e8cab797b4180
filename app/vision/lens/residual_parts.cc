#include "app/vision/lens/residual_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "app/vision/lens/view_selection.h"

namespace plumbline::vision {
namespace {

// Cells of the image are square, small enough for a drop and large enough for this many corners ..
constexpr double kCornersInCell = 4;
constexpr double kFewestAcross = 8, kMostAcross = 64;  // .. where the image has that many
constexpr int kSignDraws = 399;                        // least p-value 1/400
constexpr double kSignificant = 0.01;
constexpr double kMedianVariance = 1.57;  // to that of the mean, of normal values

/// Sums of the residuals of each view in each cell of the image.
struct CellSums {
  int columns = 0, rows = 0;
  double side_px = 0;
  struct Part {
    std::size_t view = 0;
    lens::Vec2 sum = lens::Vec2::Zero();
    int corners = 0;
  };
  std::vector<std::vector<Part>> parts;  ///< per cell, one for each view that has a corner there

  /// @param all    also the corners that the fit excludes
  /// @param first  view; those before it are left out
  CellSums(const LensFit& fit, std::span<const BoardView> views, image::ImageSize size, bool all,
           std::size_t first = 0) {
    double corners = 0;
    for (const BoardView& view : views)
      corners += static_cast<double>(std::ranges::count(view.seen, true));
    const double across = std::sqrt(corners / kCornersInCell * size.width / size.height);
    columns = static_cast<int>(std::clamp(across, kFewestAcross, kMostAcross));
    side_px = static_cast<double>(size.width) / columns;
    rows = static_cast<int>(std::ceil(size.height / side_px));
    parts.resize(static_cast<std::size_t>(columns) * rows);
    for (std::size_t j = first; j < views.size(); ++j) {
      for (std::size_t k = 0; k < views[j].corners_px.size(); ++k) {
        // A point that does not take part has a residual of zero.
        const bool takes_part =
            all ? views[j].seen[k] && !fit.residuals_px[j][k].isZero(0) : bool{fit.used[j][k]};
        if (takes_part) Add(j, views[j].corners_px[k], fit.residuals_px[j][k]);
      }
    }
  }
  lens::Vec2 CentreOf(std::size_t cell) const {
    const auto column = static_cast<double>(cell % columns);
    const auto row = static_cast<double>(cell / columns);
    return side_px * lens::Vec2(column + 0.5, row + 0.5);
  }

 private:
  void Add(std::size_t view, const lens::Vec2& at, const lens::Vec2& residual) {
    const int column = std::clamp(static_cast<int>(at.x() / side_px), 0, columns - 1);
    const int row = std::clamp(static_cast<int>(at.y() / side_px), 0, rows - 1);
    std::vector<Part>& cell = parts[static_cast<std::size_t>(row) * columns + column];
    if (cell.empty() || cell.back().view != view) cell.push_back({view});
    cell.back().sum += residual;
    ++cell.back().corners;
  }
};

/// Sum of the products of residuals of different views in one cell, over all cells.
/// @param sign  +1 or -1 of each view
double ProductsOf(const CellSums& sums, const std::vector<double>& sign) {
  double products = 0;
  for (const auto& cell : sums.parts) {
    lens::Vec2 all = lens::Vec2::Zero();
    double own = 0;
    for (const CellSums::Part& part : cell) {
      all += sign[part.view] * part.sum;
      own += part.sum.squaredNorm();
    }
    products += all.squaredNorm() - own;
  }
  return products;
}

double PValueOf(const CellSums& sums, std::size_t views) {
  const double products = ProductsOf(sums, std::vector<double>(views, 1));
  std::mt19937 random(1);  // the same result for the same capture
  std::vector<double> sign(views);
  int as_large = 1;
  for (int draw = 0; draw < kSignDraws; ++draw) {
    for (double& s : sign) s = random() % 2 == 0 ? 1 : -1;
    as_large += ProductsOf(sums, sign) >= products;
  }
  return static_cast<double>(as_large) / (kSignDraws + 1);
}

struct ImagePart {
  double variance_px2 = 0;  ///< of a coordinate
  double corners_per_cell = 0;
};

ImagePart ImagePartOf(const CellSums& sums, std::size_t views) {
  double pairs = 0, corners = 0, squares = 0;
  for (const auto& cell : sums.parts) {
    double all = 0, own = 0;
    for (const CellSums::Part& part : cell) {
      all += part.corners;
      own += static_cast<double>(part.corners) * part.corners;
    }
    pairs += all * all - own;
    corners += all;
    squares += all * all;
  }
  ImagePart part;
  if (pairs > 0)
    part.variance_px2 =
        std::max(0.0, 0.5 * ProductsOf(sums, std::vector<double>(views, 1)) / pairs);
  if (corners > 0) part.corners_per_cell = squares / corners;
  return part;
}

/// The middle value; of an even number the smaller of the two, or zero if their signs differ.
double MedianTowardsZero(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  const double high = values[half], low = values[(values.size() - 1) / 2];
  if (low * high < 0) return 0;
  return std::abs(low) < std::abs(high) ? low : high;
}

/// What one cell says about the field fixed in the image.
struct CellField {
  double square_px2 = 0;          ///< of the median displacement over the views
  double of_mean_px2 = INFINITY;  ///< its variance, both coordinates together
};

/// @param corner_px2  variance of a corner's coordinate; what the corners of one view in a cell
/// have in
///                    common counts as one
CellField FieldIn(const std::vector<CellSums::Part>& cell, double corner_px2) {
  if (cell.size() < 2) return {};
  std::vector<double> x, y;
  for (const CellSums::Part& part : cell) {
    x.push_back(part.sum.x() / part.corners);
    y.push_back(part.sum.y() / part.corners);
  }
  const auto views = static_cast<double>(cell.size());
  return {
      std::pow(MedianTowardsZero(std::move(x)), 2) + std::pow(MedianTowardsZero(std::move(y)), 2),
      2 * kMedianVariance * corner_px2 / views};
}

/// Largest displacement of the field within each candidate radius, see ResidualParts::field_px.
void IncludeField(const CellSums& sums, double in_image_px2, double corner_px2,
                  image::ImageSize size, RadiusErrors& field_px) {
  const double least = 2 * std::log(2 * static_cast<double>(sums.parts.size()) / kSignificant);
  const lens::Vec2 middle(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  for (std::size_t cell = 0; cell < sums.parts.size(); ++cell) {
    const CellField found = FieldIn(sums.parts[cell], corner_px2);
    const double shrink = 2 * in_image_px2 / (2 * in_image_px2 + found.of_mean_px2);
    double square_px2 = 2 * in_image_px2 * (1 - shrink) + shrink * shrink * found.square_px2;
    // In units of its variance, half of it in each coordinate, the square is chi^2 of two degrees.
    if (2 * found.square_px2 > least * found.of_mean_px2) square_px2 = found.square_px2;
    const double away_px = (sums.CentreOf(cell) - middle).norm();
    for (std::size_t k = 0; k < kCandidateRadii && away_px <= CandidateRadius(k, size); ++k)
      field_px[k] = std::max(field_px[k], std::sqrt(square_px2));
  }
}

}  // namespace

ResidualParts PartsOf(const LensFit& fit, const ViewConsistency& consistency,
                      std::span<const BoardView> views, image::ImageSize size) {
  ResidualParts parts;
  parts.noise_px = std::min(consistency.noise_px, fit.sigma_px);
  const CellSums sums(fit, views, size, false);
  const ImagePart image = ImagePartOf(sums, views.size());
  parts.corners_per_cell = image.corners_per_cell;
  const double smooth = std::max(0.0, fit.sigma_px * fit.sigma_px - std::pow(parts.noise_px, 2));
  const double board = std::min(SharedVariance(fit), smooth);
  const bool significant = PValueOf(sums, views.size()) <= kSignificant;
  const double in_image = significant ? std::min(image.variance_px2, smooth) : 0;
  parts.image_px = std::sqrt(in_image);
  parts.board_px = std::sqrt(board);
  parts.view_px = std::sqrt(std::max(0.0, smooth - board - in_image));
  // A drop on the glass makes outliers of the few corners behind it. It may have fallen during the
  // capture: the lens after the last view is the one that is used.
  for (const std::size_t first : {std::size_t{0}, views.size() / 2})
    IncludeField({fit, views, size, true, first}, in_image, fit.sigma_px * fit.sigma_px, size,
                 parts.field_px);
  return parts;
}

double WideningByImage(const ResidualParts& parts, double sigma_px, double unit_px) {
  const double common_px2 = parts.corners_per_cell * parts.image_px * parts.image_px;
  return (sigma_px * sigma_px + common_px2) / std::max(1e-12, unit_px * unit_px);
}

}  // namespace plumbline::vision
