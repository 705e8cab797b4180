#include "app/diagnosis/residual_spread.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "app/diagnosis/thresholds.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::diagnosis {
namespace {

/// t(0.975, freedom) / z(0.975) [Abramowitz & Stegun 26.7.5]; 2 % low at two degrees of freedom,
/// and taken as of two where there is one.
double StudentFactor(int freedom) {
  constexpr double kZ = 1.959964;
  const double n = std::max(2, freedom), z2 = kZ * kZ;
  const double g1 = (z2 + 1) / 4;
  const double g2 = (5 * z2 * z2 + 16 * z2 + 3) / 96;
  const double g3 = (3 * z2 * z2 * z2 + 19 * z2 * z2 + 17 * z2 - 15) / 384;
  return 1 + g1 / n + g2 / (n * n) + g3 / (n * n * n);
}

/// The largest share of n independent rows that may lie outside a radius for it to hold all but a
/// share p of new rows with a confidence of 1 - `significance`: the largest k with
/// P(X <= k) <= significance, X binomial [Wilks, Ann. Math. Stat. 12 (1941) 91]. 0 where n is too
/// small for any k: the radius is then that of the largest error.
double ShareOutside(int n, double p, double significance) {
  double below = 0;
  for (int k = 0; k < n; ++k) {
    below += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                      k * std::log(p) + (n - k) * std::log1p(-p));
    if (below > significance) return std::max(0, k - 1) / static_cast<double>(n);
  }
  return 1;
}

double Squared(double value) {
  return value * value;
}

/// What one variance is the sum of: of every row, of rows of other sessions, by distance squared.
using Components = Eigen::Array3d;

/// A row held out: the square of its error on one axis, and how its variance is composed.
struct HeldOutSquare {
  double square_m2 = 0;
  Components share = Components::Zero();  ///< variance = share . components
  int fold = 0;
  Vec3 before = Vec3::Zero(), after = Vec3::Zero();
};

/// Rows held out in one way.
struct WaySquares {
  std::vector<HeldOutSquare> rows;      ///< without outliers
  std::vector<HeldOutSquare> with_all;  ///< with them
  int folds = 0;                        ///< of which any row was predicted
  bool other_sessions = false;
};

WaySquares SquaresOfWay(const HeldOut& way, const PerRow<double>& weights, double axes,
                        double lost_m, Correction correction) {
  WaySquares squares;
  squares.other_sessions = way.other_sessions;
  std::set<int> folds;
  for (const RowIndex row : way.predicted.indices()) {
    if (!way.predicted[row]) continue;
    const double error_m = correction == Correction::kNone
                               ? way.before[row].norm()
                               : std::hypot(way.after[row].norm(), lost_m);
    const double reach = correction == Correction::kFading ? way.reach[row] : 0;
    const double beyond = std::max(0.0, Squared(way.distance[row]) - Squared(reach));
    const HeldOutSquare one{error_m * error_m / axes,
                            {1, way.other_sessions ? 1.0 : 0.0, beyond},
                            way.fold_of[row],
                            way.before[row],
                            way.after[row]};
    squares.with_all.push_back(one);
    folds.insert(way.fold_of[row]);
    if (weights[row] >= kOutlierWeight) squares.rows.push_back(one);
  }
  squares.folds = static_cast<int>(folds.size());
  return squares;
}

/// Maximum likelihood by the multiplicative steps of Zhou, Hu, Zhou & Lange (J. Comput. Graph.
/// Stat. 28 (2019) 350), which keep every component positive and never lower the likelihood.
Components MostLikely(const std::vector<HeldOutSquare>& rows, double least_near_m2) {
  constexpr int kMostSteps = 300;
  constexpr double kSettled = 1e-6;  // of each component
  Components sum = Components::Zero();
  double squares_m2 = 0;
  for (const HeldOutSquare& row : rows) {
    sum += row.share;
    squares_m2 += row.square_m2;
  }
  // Each starts as if it were the only one; one that no row has is zero.
  Components components = (sum > 0).select(squares_m2 / sum.max(1e-300), 0.0);
  components[0] = std::max(components[0], least_near_m2);
  for (int step = 0; step < kMostSteps; ++step) {
    const Components last = components;
    Components up = Components::Zero(), down = Components::Zero();
    for (const HeldOutSquare& row : rows) {
      const double variance = (row.share * components).sum();
      up += row.share * (row.square_m2 / (variance * variance));
      down += row.share / variance;
    }
    components = (down > 0).select(components * (up / down.max(1e-300)).sqrt(), 0.0);
    components[0] = std::max(components[0], least_near_m2);
    if (((components - last).abs() <= kSettled * last).all()) break;
  }
  return components;
}

/// Mean of the squares over what the components make them; 1 where there is no row.
double MeanRatio(const std::vector<HeldOutSquare>& rows, const Components& components) {
  double sum = 0;
  for (const HeldOutSquare& row : rows) sum += row.square_m2 / (row.share * components).sum();
  return rows.empty() ? 1 : sum / static_cast<double>(rows.size());
}

/// Number of independent rows that say as much of the share outside a radius: rows of one fold err
/// alike. The number of rows over the design effect, the variance between folds of the number
/// outside over that of a binomial [Rao & Scott, Biometrics 48 (1992) 577].
/// @param outside  of each row
int IndependentRows(const std::vector<HeldOutSquare>& rows, const std::vector<bool>& outside) {
  struct Fold {
    double rows = 0, outside = 0;
  };
  std::map<int, Fold> folds;
  const auto n = static_cast<double>(rows.size());
  double share = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    Fold& fold = folds[rows[k].fold];
    fold.rows += 1;
    if (outside[k]) fold.outside += 1;
    share += outside[k] ? 1 / n : 0;
  }
  const auto count = static_cast<double>(folds.size());
  if (count < 2 || share <= 0 || share >= 1) return static_cast<int>(n);
  double squares = 0;
  for (const auto& [number, fold] : folds) squares += Squared(fold.outside - fold.rows * share);
  const double effect = count / (count - 1) * squares / (n * share * (1 - share));
  return std::max(1, static_cast<int>(n / std::max(1.0, effect)));
}

/// By what the components have to grow for their 95 % radius to hold 95 % of new rows with a
/// confidence of 80 %, as far as the rows of one way show it.
/// @param declared_m2  of the declared model, where the correction fades; 0 where it does not
double GrowthOfRadius(const std::vector<HeldOutSquare>& rows, const Components& components,
                      double declared_m2, double axes) {
  if (rows.empty()) return 0;
  std::vector<double> ratios;
  ratios.reserve(rows.size());
  for (const HeldOutSquare& row : rows) {
    Components parts = row.share * components;
    double square_m2 = row.square_m2;
    if (declared_m2 > 0 && parts[2] > 0) {
      const double kept = declared_m2 / (declared_m2 + parts[2]);
      parts[2] *= kept;
      square_m2 = (row.before + kept * (row.after - row.before)).squaredNorm() / axes;
    }
    ratios.push_back(axes * square_m2 / parts.sum());
  }
  std::vector<double> sorted = ratios;
  std::sort(sorted.begin(), sorted.end());
  const auto inside = [&sorted](double share_outside) {
    const auto count = static_cast<double>(sorted.size());
    const double last = std::max(0.0, count - 1 - std::floor(share_outside * count));
    return sorted[static_cast<std::size_t>(last)];
  };
  std::vector<bool> outside;
  for (const double ratio : ratios) outside.push_back(ratio > inside(kOutsideRadius));
  const double share =
      ShareOutside(IndependentRows(rows, outside), kOutsideRadius, kRadiusSignificance);
  return inside(share) / statistics::ChiSquareQuantile(kOutsideRadius, axes);
}

/// The variance on one axis that the declared model leaves in regions and sessions held out.
double DeclaredVariance(const std::vector<WaySquares>& ways, double axes) {
  double sum_m2 = 0, count = 0;
  for (std::size_t way = 1; way < ways.size(); ++way) {
    for (const HeldOutSquare& row : ways[way].rows) sum_m2 += row.before.squaredNorm() / axes;
    count += static_cast<double>(ways[way].rows.size());
  }
  return count > 0 ? sum_m2 / count : 0;
}

/// Few regions and sessions say little of the next one.
Components WidenedForFew(Components components, const std::vector<WaySquares>& ways) {
  int regions = 0, sessions = 0;
  for (std::size_t way = 1; way < ways.size(); ++way) {
    (ways[way].other_sessions ? sessions : regions) += ways[way].folds;
  }
  components[1] *= Squared(StudentFactor(sessions));
  components[2] *= Squared(StudentFactor(regions + sessions));
  double beyond = 0;
  for (std::size_t way = 1; way < ways.size(); ++way) {
    const double excess = MeanRatio(ways[way].rows, components) - 1;
    beyond = std::max(beyond, Squared(StudentFactor(ways[way].folds)) * excess);
  }
  return components * (1 + beyond);
}

}  // namespace

std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction) {
  const double axes = problem.data.lengths_per_row();
  std::vector<WaySquares> ways;
  std::vector<HeldOutSquare> rows;
  bool away = false;  // any row was predicted from elsewhere than between the rows
  const bool fades = correction == Correction::kFading;
  std::vector<const HeldOut*> held_out;
  for (const HeldOut& way : validation.ways) held_out.push_back(&way);
  if (fades && validation.halves) held_out.push_back(&*validation.halves);
  for (const HeldOut* way : held_out) {
    ways.push_back(SquaresOfWay(*way, problem.weights, axes, validation.lost_m, correction));
    const std::vector<HeldOutSquare>& of_way = ways.back().rows;
    rows.insert(rows.end(), of_way.begin(), of_way.end());
    away = away || (ways.size() > 1 && !of_way.empty());
  }
  if (!away) return std::nullopt;
  const Components likely = MostLikely(rows, Squared(problem.sigma_m));
  Components components = WidenedForFew(likely, ways);
  // The share that is applied rests on the most likely variances: widening both alike keeps it.
  const double widened = likely[2] > 0 ? components[2] / likely[2] : 1;
  const double declared_m2 = fades ? widened * DeclaredVariance(ways, axes) : 0;
  double ratio = 1;
  for (const WaySquares& way : ways) {
    ratio = std::max(ratio, GrowthOfRadius(way.with_all, components, declared_m2, axes));
  }
  components *= ratio;
  ResidualSpread spread{std::sqrt(components[0] + components[1]), std::sqrt(components[2]), {}};
  if (fades) spread.declared_m = std::sqrt(ratio * declared_m2);
  return spread;
}

}  // namespace plumbline::diagnosis
