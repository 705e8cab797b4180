// Quantiles and tail probabilities, the median of a range and the 95 % radius of a normal error.
#pragma once

#include <algorithm>
#include <cassert>
#include <span>

#include "firmware-like/geometry/pose.h"

namespace plumbline::statistics {

/// Median of the values; for an even count the mean of the two middle ones. Does not allocate.
/// @param values  at least one, no NaN; reordered by the call
inline double MedianOf(std::span<double> values) {
  assert(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

// Quantiles of Student's t distribution: coverage factors of expanded uncertainties.

/// Coverage probability of two standard deviations of a normal distribution.
inline constexpr double kTwoSigmaCoverage = 0.9544997361036416;

/// The factor k with P(|t| <= k) = `coverage` for Student's t (GUM, table G.2). For infinite
/// degrees of freedom it is that of the normal distribution: 2 for kTwoSigmaCoverage. Uses
/// bisection to machine precision; not for the control cycle.
/// @param coverage  0 < coverage < 1
/// @param freedom   degrees of freedom, 1 or more; need not be whole
double StudentCoverageFactor(double coverage, double freedom);

/// Radius of the sphere that contains 95 % of a zero-mean normal error with covariance C [m^2].
/// |e|^2 is approximated by a chi^2_nu with a = tr(C^2)/tr(C), nu = tr(C)^2/tr(C^2) [Satterthwaite
/// 1946], and its quantile by the Wilson-Hilferty formula. Within 2 % of the exact
/// radius for every C.
double RadiusHolding95Percent(const Mat3& covariance);

/// P(chi^2 > value) for the given degrees of freedom; 1 for value <= 0.
double ChiSquareTail(double value, double freedom);

/// The value that chi^2 exceeds with probability `tail`, 0 < tail < 1. Uses bisection with about a
/// hundred evaluations of the tail; not for the control cycle.
double ChiSquareQuantile(double tail, double freedom);

/// Wilson-Hilferty approximation of that quantile, cheap enough for the control cycle:
///   n (1 - 2 / (9 n) + z sqrt(2 / (9 n)))^3   [E. B. Wilson, M. M. Hilferty, PNAS 17 (1931) 684]
/// At a tail of 5 % the error is below 2.5 % for n >= 1 and decreases with n.
/// @param normal   z, the value that a standard normal variable exceeds with that probability
/// @param freedom  n, degrees of freedom
double ChiSquareQuantileNear(double normal, double freedom);

/// z for a one-sided tail of 5 %.
inline constexpr double kNormal95 = 1.6448536269514722;

}  // namespace plumbline::statistics
