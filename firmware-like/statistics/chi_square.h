// Tail probabilities and quantiles of the chi-squared distribution.
#pragma once

namespace plumbline::statistics {

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
