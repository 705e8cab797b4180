#include "app/diagnosis/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/robust.h"
#include "app/diagnosis/thresholds.h"
#include "app/diagnosis/words.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline {
namespace {

std::vector<HeldOutError> ErrorsOfWays(const HeldOutInput& input,
                                       const std::vector<HeldOut>& ways) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& way : ways) {
    const auto error = ErrorOf(input.problem, way, input.options.bootstrap);
    if (error) errors.push_back(*error);
  }
  return errors;
}

/// Sums of squares over predicted rows, with the discrepancy model and without.
std::pair<double, double> SquaresOf(const HeldOut& way, const PerRow<double>& weights) {
  double with = 0, without = 0;
  for (const RowIndex row : way.after.indices()) {
    if (!way.predicted[row] || weights[row] < kOutlierWeight) continue;
    with += way.after[row].squaredNorm();
    without += way.after_named[row].squaredNorm();
  }
  return {with, without};
}

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

/// The deviation whose 95 % radius the held-out rows do not refute, including rows that the fit
/// rejected: a robot that misses one point in ten by a millimetre will miss one of the next ten,
/// too. With the true radius, the number of rows outside is binomial with p = 0.05; this is the
/// smallest radius at which a number as large has a probability of at least 0.2.
double UnrefutedSigma(const HeldOut& way, double axes, bool corrected) {
  std::vector<double> errors_m;
  const PerRow<Vec3>& errors = corrected ? way.after : way.before;
  for (const RowIndex row : errors.indices()) {
    if (way.predicted[row]) errors_m.push_back(errors[row].norm());
  }
  const auto count = static_cast<int>(errors_m.size());
  int outside = 0;
  while (outside < count && BinomialTail(count, outside + 1, kOutsideRadius) >= kUnrefutedChance)
    ++outside;
  if (outside >= count) return 0;
  std::sort(errors_m.begin(), errors_m.end());
  const double radius_m = errors_m[static_cast<std::size_t>(count - 1 - outside)];
  return radius_m / std::sqrt(ChiSquareQuantile(kOutsideRadius, axes));
}

/// Groups of which any row was predicted.
int FoldsPredicted(const HeldOut& way) {
  std::set<int> folds;
  for (const RowIndex row : way.predicted.indices()) {
    if (way.predicted[row]) folds.insert(way.fold_of[row]);
  }
  return static_cast<int>(folds.size());
}

}  // namespace

std::optional<double> ValidatedSigma(const Validation& validation, double sigma_m, double axes,
                                     bool corrected) {
  const auto variance = [&](const HeldOutError& error) {
    const double rms_m = corrected ? error.after_m : error.before_m;
    return rms_m * rms_m / axes;
  };
  double between = sigma_m * sigma_m, largest = 0;
  bool regions_held_out = false;
  for (const HeldOutError& error : validation.errors) {
    if (error.by == validation.ways.front().by) between = std::max(between, variance(error));
  }
  largest = between;
  for (const HeldOutError& error : validation.errors) {
    if (error.by == validation.ways.front().by) continue;
    regions_held_out = true;
    const auto way = std::find_if(validation.ways.begin(), validation.ways.end(),
                                  [&](const HeldOut& one) { return one.by == error.by; });
    const double factor = StudentFactor(FoldsPredicted(*way));
    const double beyond = std::max(0.0, variance(error) - between);
    largest = std::max(largest, between + factor * factor * beyond);
  }
  if (!regions_held_out) return std::nullopt;
  double sigma = std::sqrt(largest);
  for (const HeldOut& way : validation.ways) {
    sigma = std::max(sigma, UnrefutedSigma(way, axes, corrected));
  }
  return sigma;
}

Validation Validate(const HeldOutInput& input) {
  const Dataset& data = input.problem.data;
  Validation validation;
  for (const FoldPlan& plan : {BlocksOfTime(data), RegionsOfJointSpace(data), Sessions(data)}) {
    if (plan.folds > 0) validation.ways.push_back(HoldOut(input, plan));
  }
  validation.errors = ErrorsOfWays(input, validation.ways);
  return validation;
}

void AddError(double lost_m, Validation& validation) {
  for (HeldOutError& error : validation.errors) {
    for (double* rms_m : {&error.after_m, &error.after_low_m, &error.after_high_m}) {
      *rms_m = std::hypot(*rms_m, lost_m);
    }
  }
}

bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights) {
  const std::size_t first = validation.ways.size() > 1 ? 1 : 0;
  for (std::size_t way = first; way < validation.ways.size(); ++way) {
    const auto [with, without] = SquaresOf(validation.ways[way], weights);
    if (with > 0 && !(with < without)) return false;
  }
  return !validation.ways.empty();
}

Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation) {
  for (HeldOut& way : validation.ways) way.after = way.after_named;
  validation.errors = ErrorsOfWays(input, validation.ways);
  return validation;
}

std::string ReasonToWithhold(const Validation& validation, bool empirical) {
  if (validation.errors.empty()) {
    return "too few rows to hold any out: nothing tests the correction, and none is written; "
           "measure "
           "more poses, spread over the cell";
  }
  for (const HeldOutError& error : validation.errors) {
    const bool between_rows = error.by == validation.ways.front().by;
    if (!empirical && !between_rows) continue;
    if (error.after_m <= error.before_m) continue;
    return fmt::format(
        "held out by {}, the corrected model errs by {} mm, the declared one by {} mm: no "
        "correction is written; find the cause first",
        error.by, MillimetreText(error.after_m), MillimetreText(error.before_m));
  }
  return {};
}

}  // namespace plumbline
