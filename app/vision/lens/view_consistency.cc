#include "app/vision/lens/view_consistency.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

constexpr double kNormalOfMedian = 1.4826;
constexpr double kMinNoise_px = 1e-3;
constexpr double kMaxOutlier = 6;      // second difference, in standard deviations
constexpr double kMaxRoughness = 4;    // noise of a view, in units of the median
constexpr double kMaxNoisy = 1.5;      // RMS of a view without displacement, in units of its noise
constexpr double kMaxMisfitRatio = 3;  // RMS of a view, in units of the median

/// Second differences r[a] - 2 r[b] + r[c] of neighbours in a row or column of the board, for each
/// corner those in which it takes part.
struct Triples {
  std::vector<std::array<std::size_t, 3>> all;

  Triples(const target::Board& board, const std::vector<bool>& seen) {
    const auto add = [&](int k, int step) {
      const std::array<std::size_t, 3> triple{static_cast<std::size_t>(k - step),
                                              static_cast<std::size_t>(k),
                                              static_cast<std::size_t>(k + step)};
      if (seen[triple[0]] && seen[triple[1]] && seen[triple[2]]) all.push_back(triple);
    };
    for (int k = 0; k < board.corners(); ++k) {
      const int column = k % board.columns, row = k / board.columns;
      if (column > 0 && column + 1 < board.columns) add(k, 1);
      // Rows of an asymmetric grid are shifted: compare every other row.
      const int rows = board.kind == target::BoardKind::kAsymmetricCircles ? 2 : 1;
      if (row >= rows && row + rows < board.rows) add(k, rows * board.columns);
    }
  }
};

lens::Vec2 SecondDifference(const std::vector<lens::Vec2>& residuals,
                            const std::array<std::size_t, 3>& t) {
  return (residuals[t[0]] - 2 * residuals[t[1]] + residuals[t[2]]) / std::sqrt(6.0);
}

/// Per coordinate [px].
double RmsOf(const std::vector<lens::Vec2>& residuals, const std::vector<bool>& used) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    if (!used[k]) continue;
    sum += residuals[k].squaredNorm();
    count += 2;
  }
  return count > 0 ? std::sqrt(sum / count) : INFINITY;
}

}  // namespace

ViewConsistency ConsistencyOf(const target::Board& board, const LensFit& fit,
                              std::span<const BoardView> views) {
  ViewConsistency result;
  std::vector<Triples> triples;
  for (std::size_t j = 0; j < views.size(); ++j) {
    triples.emplace_back(board, views[j].seen);
    std::vector<double> sizes;
    for (const auto& triple : triples[j].all) {
      const lens::Vec2 d = SecondDifference(fit.residuals_px[j], triple);
      sizes.push_back(std::abs(d.x()));
      sizes.push_back(std::abs(d.y()));
    }
    result.view_noise_px.push_back(sizes.empty() ? fit.sigma_px
                                                 : kNormalOfMedian * statistics::MedianOf(sizes));
  }
  std::vector<double> noises = result.view_noise_px, sizes = fit.view_rms_px;  // reordered below
  result.noise_px = std::max(kMinNoise_px, statistics::MedianOf(noises));
  const double usual_px = std::max(statistics::MedianOf(sizes), 0.01);
  for (std::size_t j = 0; j < views.size(); ++j) {
    // A corner is an outlier if it deviates in every triple; its neighbours have a clean one.
    std::vector<double> least(views[j].seen.size(), INFINITY);
    for (const auto& triple : triples[j].all) {
      const double size = SecondDifference(fit.residuals_px[j], triple).norm();
      for (const std::size_t k : triple) least[k] = std::min(least[k], size);
    }
    std::vector<bool> used = views[j].seen;
    const double noise_px = std::max(result.noise_px, result.view_noise_px[j]);
    for (std::size_t k = 0; k < used.size(); ++k) {
      if (std::isfinite(least[k]) && least[k] > kMaxOutlier * noise_px) used[k] = false;
    }
    result.used.push_back(std::move(used));
    const auto seen = std::ranges::count(views[j].seen, true);
    const auto fitted = std::ranges::count(fit.used[j], true);
    if (fit.view_rms_px[j] <= kMaxMisfitRatio * usual_px && 2 * fitted >= seen) continue;
    if (RmsOf(fit.residuals_px[j], result.used[j]) < kMaxNoisy * noise_px &&
        noise_px < kMaxRoughness * result.noise_px)
      continue;  // noisier than the others, but not displaced
    const auto smooth = std::ranges::count(result.used[j], true);
    const bool rough =
        result.view_noise_px[j] > kMaxRoughness * result.noise_px || 2 * smooth < seen;
    (rough ? result.wrong : result.displaced).push_back(j);
  }
  return result;
}

std::vector<std::size_t> RepeatedViews(std::span<const BoardView> views) {
  std::vector<std::size_t> repeated;
  for (std::size_t j = 1; j < views.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      if (views[i].corners_px != views[j].corners_px || views[i].seen != views[j].seen) continue;
      repeated.push_back(j);
      break;
    }
  }
  return repeated;
}

}  // namespace plumbline::vision
