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

/// Variance components: common to all rows, of held-out sessions, per squared distance of the
/// posture, and per squared distance of each other input.
enum Component { kNear, kSession, kPosture, kOthers };
constexpr int kComponents = kOthers + kInputs;
constexpr int kTimeComponent = kOthers + static_cast<int>(ModelInput::kTime);
using Components = Eigen::Array<double, kComponents, 1>;

/// A held-out row: its squared error on one axis, and the coefficients of its variance components.
struct HeldOutSquare {
  double square_m2 = 0;
  Components share = Components::Zero();  ///< variance = share . components
  double noise_m2 = 0;                    ///< noise that this row states in excess of sigma, known
  int fold = 0;
  double weight = 1;         ///< in the likelihood
  double added_error_m = 0;  ///< of the correction as written
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
    const double beyond = std::max(0.0, Squared(scheme.distance[row]) - Squared(scheme.reach[row]));
    HeldOutSquare one;
    one.square_m2 = error_m * error_m / axes;
    one.share << 1, (scheme.other_sessions ? 1.0 : 0.0), beyond, scheme.beyond[row];
    one.noise_m2 = ExcessNoise(problem, row);
    one.fold = scheme.fold_of[row];
    one.before = scheme.before[row];
    one.after = scheme.after[row];
    one.added_error_m = correction == Correction::kNone ? 0 : added_error_m;
    squares.with_outliers.push_back(one);
    folds.insert(scheme.fold_of[row]);
    if (problem.weights[row] >= kOutlierWeight) squares.rows.push_back(one);
  }
  squares.folds = static_cast<int>(folds.size());
  return squares;
}

/// A priori: inverse gamma distributions of the variance components.
struct Prior {
  Components mode_m2 = Components::Zero();
  double rows = 0;  ///< that weigh as much as each of them
};

/// Mode of the posterior by the MM algorithm of Zhou, Hu, Zhou & Lange (J. Comput. Graph. Stat. 28
/// (2019) 350), whose multiplicative steps keep every component positive and never decrease the
/// likelihood; the prior is one more term of the same form.
Components PosteriorMode(const std::vector<HeldOutSquare>& rows, const Prior& prior,
                         double min_near_m2) {
  constexpr int kMaxSteps = 300;
  constexpr double kConverged = 1e-6;  // relative change of each component
  Components components = prior.mode_m2;
  components[kNear] = min_near_m2;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Components last = components;
    Components up = Components::Zero(), down = Components::Zero();
    for (const HeldOutSquare& row : rows) {
      const double variance = VarianceOf(row, components);
      up += row.weight * row.share * (row.square_m2 / (variance * variance));
      down += row.weight * row.share / variance;
    }
    const auto has_prior = prior.mode_m2 > 0;
    up += has_prior.select(prior.rows * prior.mode_m2 / components.square(), 0.0);
    down += has_prior.select(prior.rows / components, 0.0);
    components = (down > 0).select(components * (up / down.max(1e-300)).sqrt(), 0.0);
    components[kNear] = std::max(components[kNear], min_near_m2);
    if (((components - last).abs() <= kConverged * last).all()) break;
  }
  return components;
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
    auto gained = parts.tail<kComponents - kPosture>();
    if (declared_m2 > 0 && gained.sum() > 0) {
      const double kept = declared_m2 / (declared_m2 + gained.sum());
      gained *= kept;
      square_m2 = ((row.before + kept * (row.after - row.before)).squaredNorm() +
                   Squared(kept * row.added_error_m)) /
                  axes;
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

/// Smallest mean square on one axis of the declared model's errors in any group of rows [m^2].
class LeastDeviation {
 public:
  explicit LeastDeviation(double axes) : axes_(axes) {}
  void Add(double group, const Vec3& before) {
    auto& [sum_m2, count] = groups_[group];
    sum_m2 += before.squaredNorm() / axes_;
    count += 1;
  }
  /// Variance `all_m2` over that of the group with the least; 1 if no group has enough rows.
  double RatioOf(double all_m2, double noise_m2) const {
    constexpr double kMinRows = 5, kLargest = 100;
    double ratio = 1;
    for (const auto& [group, sum] : groups_) {
      if (sum.second < kMinRows) continue;
      ratio = std::max(ratio, all_m2 / std::max(noise_m2, sum.first / sum.second));
    }
    return std::min(ratio, kLargest);
  }

 private:
  double axes_;
  std::map<double, std::pair<double, double>> groups_;
};

/// Factors on the components of a correction that fades, so that it is no worse than none where
/// the deviation to be corrected is smallest, too: along the posture, that of the regions that were
/// held out; along the payload, that of the loads.
Components CautionOf(const std::vector<const HeldOut*>& held_out, const FitProblem& problem,
                     double deviation_m2, double axes) {
  const Dataset& data = problem.data;
  LeastDeviation of_loads(axes);
  Components caution = Components::Ones();
  double& posture = caution[kPosture];
  for (const HeldOut* scheme : held_out) {
    LeastDeviation of_folds(axes);
    for (const RowIndex row : scheme->predicted.indices()) {
      if (!scheme->predicted[row] || problem.weights[row] < kOutlierWeight) continue;
      of_folds.Add(scheme->fold_of[row], scheme->before[row]);
      if (data.loads_recorded() && scheme == held_out.front())
        of_loads.Add(data.conditions[row].payload_kg, scheme->before[row]);
    }
    const bool regions = scheme != held_out.front() && !scheme->other_sessions;
    if (regions)
      posture = std::max(posture, of_folds.RatioOf(deviation_m2, Squared(problem.sigma_m)));
  }
  caution[kOthers + static_cast<int>(ModelInput::kRange)] = posture;
  caution[kOthers + static_cast<int>(ModelInput::kPayload)] =
      of_loads.RatioOf(deviation_m2, Squared(problem.sigma_m));
  return caution;
}

/// Rows of one fold have correlated errors: those of a held-out region or session together weigh as
/// much as kRowsPerFold.
constexpr double kRowsPerFold = 3;

void WeighByFolds(SchemeSquares& scheme) {
  const double count = kRowsPerFold * scheme.folds / static_cast<double>(scheme.rows.size());
  for (HeldOutSquare& row : scheme.rows) row.weight = std::min(1.0, count);
}

}  // namespace

std::optional<ResidualSpread> SpreadOf(const Validation& validation, const FitProblem& problem,
                                       Correction correction, std::optional<double> drift_m) {
  const double axes = problem.data.lengths_per_row();
  std::vector<SchemeSquares> schemes;
  std::vector<HeldOutSquare> rows;
  bool away = false, sessions = false;  // a row of a held-out region or session was predicted
  const bool fades = correction == Correction::kFading;
  std::vector<const HeldOut*> held_out;
  for (const HeldOut& scheme : validation.schemes) held_out.push_back(&scheme);
  if (fades && validation.halves) held_out.push_back(&*validation.halves);
  for (const HeldOut* scheme : held_out) {
    SchemeSquares& own = schemes.emplace_back(
        SquaresOfScheme(*scheme, problem, axes, validation.added_error_m, correction));
    if (schemes.size() > 1) WeighByFolds(own);
    rows.insert(rows.end(), own.rows.begin(), own.rows.end());
    away = away || (schemes.size() > 1 && !own.rows.empty());
    sessions = sessions || (own.other_sessions && !own.rows.empty());
  }
  if (!away) return std::nullopt;
  const double noise_m2 = Squared(problem.sigma_m), deviation_m2 = DeclaredVariance(schemes, axes);
  Prior prior{Components::Constant(noise_m2), kRowsPerFold};
  if (correction != Correction::kWritten) prior.mode_m2 += deviation_m2;
  if (drift_m) {
    prior.mode_m2[kTimeComponent] += Squared(*drift_m) / axes;
  } else {
    prior.mode_m2[kTimeComponent] = 0;
    for (HeldOutSquare& row : rows) row.share[kTimeComponent] = 0;
  }
  prior.mode_m2[kNear] = 0;
  if (!sessions) prior.mode_m2[kSession] = 0;
  Components components = PosteriorMode(rows, prior, noise_m2);
  const double declared_m2 = fades ? deviation_m2 : 0;
  if (fades) components *= CautionOf(held_out, problem, deviation_m2, axes);
  double ratio = 1;
  for (const SchemeSquares& scheme : schemes) {
    ratio = std::max(ratio, GrowthOfRadius(scheme.with_outliers, components, declared_m2, axes));
  }
  components *= ratio;
  ResidualSpread spread{std::sqrt(components[kNear] + components[kSession]),
                        std::sqrt(components[kPosture]),
                        std::sqrt(ratio * deviation_m2),
                        components.tail<kInputs>().sqrt(),
                        {}};
  if (fades) spread.declared_m = std::sqrt(ratio * declared_m2);
  return spread;
}

}  // namespace plumbline::measure
