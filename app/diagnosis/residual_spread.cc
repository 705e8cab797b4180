#include "app/diagnosis/residual_spread.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
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

/// P(X >= k) of a binomial X of n draws with probability p.
double BinomialTail(int n, int k, double p) {
  double below = 0;
  for (int j = 0; j < k; ++j) {
    below += std::exp(std::lgamma(n + 1.0) - std::lgamma(j + 1.0) - std::lgamma(n - j + 1.0) +
                      j * std::log(p) + (n - j) * std::log1p(-p));
  }
  return 1 - below;
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

/// By what the components have to grow for their 95 % radius not to be refuted. With the true
/// radius, the number of rows outside is binomial with p = 0.05; of this one, a number as large has
/// a probability of at least 0.2.
/// @param declared_m2  of the declared model, where the correction fades; 0 where it does not
double UnrefutedRatio(const std::vector<HeldOutSquare>& rows, const Components& components,
                      double declared_m2, double axes) {
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
  const auto count = static_cast<int>(ratios.size());
  int outside = 0;
  while (outside < count &&
         BinomialTail(count, outside + 1, kOutsideRadius) >= kRadiusTestSignificance)
    ++outside;
  if (outside >= count) return 0;
  std::sort(ratios.begin(), ratios.end());
  const double largest_inside = ratios[static_cast<std::size_t>(count - 1 - outside)];
  return largest_inside / statistics::ChiSquareQuantile(kOutsideRadius, axes);
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
  Components components = WidenedForFew(MostLikely(rows, Squared(problem.sigma_m)), ways);
  const double declared_m2 = fades ? DeclaredVariance(ways, axes) : 0;
  double ratio = 1;
  for (const WaySquares& way : ways) {
    ratio = std::max(ratio, UnrefutedRatio(way.with_all, components, declared_m2, axes));
  }
  components *= ratio;
  ResidualSpread spread{std::sqrt(components[0] + components[1]), std::sqrt(components[2]), {}};
  if (fades) spread.declared_m = std::sqrt(ratio * declared_m2);
  return spread;
}

}  // namespace plumbline::diagnosis
