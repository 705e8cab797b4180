#include "app/measure/diagnosis/prediction/residual_spread.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

/// t(0.975, freedom) / z(0.975) [Abramowitz & Stegun 26.7.5]; 2 % too low for two degrees of
/// freedom. One degree of freedom is treated as two.
double StudentFactor(int freedom) {
  constexpr double kZ = 1.959964;
  const double n = std::max(2, freedom), z2 = kZ * kZ;
  const double g1 = (z2 + 1) / 4;
  const double g2 = (5 * z2 * z2 + 16 * z2 + 3) / 96;
  const double g3 = (3 * z2 * z2 * z2 + 19 * z2 * z2 + 17 * z2 - 15) / 384;
  return 1 + g1 / n + g2 / (n * n) + g3 / (n * n * n);
}

/// One-sided tolerance limit [Wilks, Ann. Math. Stat. 12 (1941) 91]: the largest share k / n of n
/// independent rows outside a radius at which it contains a share 1 - p of new rows with confidence
/// 1 - `significance`, that is, the largest k with P(X <= k) <= significance for a binomial X. 0 if
/// n is too small; the radius is then the largest error.
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

/// Variance components: common to all rows, of held-out sessions, per squared distance.
using Components = Eigen::Array3d;

/// A held-out row: its squared error on one axis, and the coefficients of its variance components.
struct HeldOutSquare {
  double square_m2 = 0;
  Components share = Components::Zero();  ///< variance = share . components
  double noise_m2 = 0;                    ///< noise that this row states in excess of sigma, known
  int fold = 0;
  Vec3 before = Vec3::Zero(), after = Vec3::Zero();
};

double VarianceOf(const HeldOutSquare& row, const Components& components) {
  return (row.share * components).sum() + row.noise_m2;
}

/// Variance on one axis by which the noise that a row states exceeds sigma. It is the instrument's,
/// not the model's, and does not count in the radius of other rows.
double ExcessNoise(const FitProblem& problem, RowIndex row) {
  const RowNumbers& numbers = problem.data.numbers[row];
  if (numbers.count == 0) return 0;
  const double relative = numbers.LengthVariance() / numbers.lengths();
  return std::max(0.0, relative - 1) * Squared(problem.sigma_m);
}

/// Held-out rows of one scheme.
struct SchemeSquares {
  std::vector<HeldOutSquare> rows;           ///< without outliers
  std::vector<HeldOutSquare> with_outliers;  ///< including outliers
  int folds = 0;                             ///< with at least one predicted row
  bool other_sessions = false;
};

SchemeSquares SquaresOfScheme(const HeldOut& scheme, const FitProblem& problem, double axes,
                              double added_error_m, Correction correction) {
  SchemeSquares squares;
  squares.other_sessions = scheme.other_sessions;
  std::set<int> folds;
  for (const RowIndex row : scheme.predicted.indices()) {
    if (!scheme.predicted[row]) continue;
    const double error_m = correction == Correction::kNone
                               ? scheme.before[row].norm()
                               : std::hypot(scheme.after[row].norm(), added_error_m);
    const double reach = correction == Correction::kFading ? scheme.reach[row] : 0;
    const double beyond = std::max(0.0, Squared(scheme.distance[row]) - Squared(reach));
    const HeldOutSquare one{
        error_m * error_m / axes,  {1, scheme.other_sessions ? 1.0 : 0.0, beyond},
        ExcessNoise(problem, row), scheme.fold_of[row],
        scheme.before[row],        scheme.after[row]};
    squares.with_outliers.push_back(one);
    folds.insert(scheme.fold_of[row]);
    if (problem.weights[row] >= kOutlierWeight) squares.rows.push_back(one);
  }
  squares.folds = static_cast<int>(folds.size());
  return squares;
}

/// Maximum likelihood estimate by the MM algorithm of Zhou, Hu, Zhou & Lange (J. Comput. Graph.
/// Stat. 28 (2019) 350), whose multiplicative steps keep every component positive and never
/// decrease the likelihood.
Components MaximumLikelihood(const std::vector<HeldOutSquare>& rows, double min_near_m2) {
  constexpr int kMaxSteps = 300;
  constexpr double kConverged = 1e-6;  // relative change of each component
  Components sum = Components::Zero();
  double squares_m2 = 0;
  for (const HeldOutSquare& row : rows) {
    sum += row.share;
    squares_m2 += row.square_m2;
  }
  // Each component starts as if it were the only one; a component that no row has is zero.
  Components components = (sum > 0).select(squares_m2 / sum.max(1e-300), 0.0);
  components[0] = std::max(components[0], min_near_m2);
  for (int step = 0; step < kMaxSteps; ++step) {
    const Components last = components;
    Components up = Components::Zero(), down = Components::Zero();
    for (const HeldOutSquare& row : rows) {
      const double variance = VarianceOf(row, components);
      up += row.share * (row.square_m2 / (variance * variance));
      down += row.share / variance;
    }
    components = (down > 0).select(components * (up / down.max(1e-300)).sqrt(), 0.0);
    components[0] = std::max(components[0], min_near_m2);
    if (((components - last).abs() <= kConverged * last).all()) break;
  }
  return components;
}

/// Mean ratio of the squared errors to their variances; 1 if there are no rows.
double MeanRatio(const std::vector<HeldOutSquare>& rows, const Components& components) {
  double sum = 0;
  for (const HeldOutSquare& row : rows) sum += row.square_m2 / VarianceOf(row, components);
  return rows.empty() ? 1 : sum / static_cast<double>(rows.size());
}

/// Effective number of independent rows for estimating the share outside a radius, since errors of
/// one fold are correlated: the number of rows divided by the design effect, which is the variance
/// between folds of the number outside relative to a binomial [Rao & Scott, Biometrics 48 (1992)
/// 577].
/// @param outside  for each row, whether it is outside
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

/// Factor on the variance components at which the rows of one scheme show, with a confidence of 80
/// %, that the 95 % radius contains 95 % of new rows.
/// @param declared_m2  variance of the declared model if the correction fades; otherwise 0
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
    ratios.push_back(axes * square_m2 / (parts.sum() + row.noise_m2));
  }
  std::vector<double> sorted = ratios;
  std::ranges::sort(sorted);
  const auto inside = [&sorted](double share_outside) {
    constexpr double kRounding = 1e-9;  // of a share that is a ratio of whole numbers
    const auto count = static_cast<double>(sorted.size());
    const double last = std::max(0.0, count - 1 - std::floor(share_outside * count + kRounding));
    return sorted[static_cast<std::size_t>(last)];
  };
  std::vector<bool> outside;
  for (const double ratio : ratios) outside.push_back(ratio > inside(kOutsideRadius));
  const double share =
      ShareOutside(IndependentRows(rows, outside), kOutsideRadius, kRadiusSignificance);
  return inside(share) / statistics::ChiSquareQuantile(kOutsideRadius, axes);
}

/// Variance of one axis of the declared model's errors in held-out regions and sessions.
double DeclaredVariance(const std::vector<SchemeSquares>& schemes, double axes) {
  double sum_m2 = 0, count = 0;
  for (std::size_t scheme = 1; scheme < schemes.size(); ++scheme) {
    for (const HeldOutSquare& row : schemes[scheme].rows) {
      sum_m2 += row.before.squaredNorm() / axes - row.noise_m2;
    }
    count += static_cast<double>(schemes[scheme].rows.size());
  }
  return count > 0 ? std::max(0.0, sum_m2 / count) : 0;
}

/// The components widened for the small number of regions and sessions and for errors that the
/// distance does not explain.
Components WidenedForFewFolds(Components components, const std::vector<SchemeSquares>& schemes) {
  int regions = 0, sessions = 0;
  for (std::size_t scheme = 1; scheme < schemes.size(); ++scheme) {
    (schemes[scheme].other_sessions ? sessions : regions) += schemes[scheme].folds;
  }
  components[1] *= Squared(StudentFactor(sessions));
  components[2] *= Squared(StudentFactor(regions + sessions));
  double beyond = 0;
  for (std::size_t scheme = 1; scheme < schemes.size(); ++scheme) {
    const double excess = MeanRatio(schemes[scheme].rows, components) - 1;
    beyond = std::max(beyond, Squared(StudentFactor(schemes[scheme].folds)) * excess);
  }
  return components * (1 + beyond);
}

}  // namespace

std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction) {
  const double axes = problem.data.lengths_per_row();
  std::vector<SchemeSquares> schemes;
  std::vector<HeldOutSquare> rows;
  bool away = false;  // a row of a held-out region or session was predicted
  const bool fades = correction == Correction::kFading;
  std::vector<const HeldOut*> held_out;
  for (const HeldOut& scheme : validation.schemes) held_out.push_back(&scheme);
  if (fades && validation.halves) held_out.push_back(&*validation.halves);
  for (const HeldOut* scheme : held_out) {
    schemes.push_back(
        SquaresOfScheme(*scheme, problem, axes, validation.added_error_m, correction));
    const std::vector<HeldOutSquare>& of_scheme = schemes.back().rows;
    rows.insert(rows.end(), of_scheme.begin(), of_scheme.end());
    away = away || (schemes.size() > 1 && !of_scheme.empty());
  }
  if (!away) return std::nullopt;
  const Components likely = MaximumLikelihood(rows, Squared(problem.sigma_m));
  Components components = WidenedForFewFolds(likely, schemes);
  // Widening both variances alike preserves the applied share of the correction.
  const double widened = likely[2] > 0 ? components[2] / likely[2] : 1;
  const double declared_m2 = fades ? widened * DeclaredVariance(schemes, axes) : 0;
  double ratio = 1;
  for (const SchemeSquares& scheme : schemes) {
    ratio = std::max(ratio, GrowthOfRadius(scheme.with_outliers, components, declared_m2, axes));
  }
  components *= ratio;
  ResidualSpread spread{std::sqrt(components[0] + components[1]), std::sqrt(components[2]), {}};
  if (fades) spread.declared_m = std::sqrt(ratio * declared_m2);
  return spread;
}

}  // namespace plumbline::measure
