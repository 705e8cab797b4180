// Chi^2: how likely a sum of squares of normal errors is.
#pragma once

namespace plumbline {

/// P(chi^2_freedom > value); 1 for value <= 0.
double ChiSquareTail(double value, double freedom);

/// The value that chi^2_freedom exceeds with probability `tail` (0..1). By bisection, some hundred
/// tails; not for the cycle.
double ChiSquareQuantile(double tail, double freedom);

/// The same in a few operations, for the cycle:
///   n (1 - 2 / (9 n) + z sqrt(2 / (9 n)))^3   [E. B. Wilson, M. M. Hilferty, PNAS 17 (1931) 684]
/// Within 2.5 % at a tail of 5 % for n from 1 on, better the more there are.
/// @param normal  z, the value that a standard normal exceeds with that probability
double ChiSquareQuantileNear(double normal, double freedom);

/// z for a tail of 5 %.
inline constexpr double kNormal95 = 1.6448536269514722;

}  // namespace plumbline
