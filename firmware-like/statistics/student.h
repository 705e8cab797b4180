// Quantiles of Student's t distribution: coverage factors of expanded uncertainties.
#pragma once

namespace plumbline::statistics {

/// Coverage probability of two standard deviations of a normal distribution.
inline constexpr double kTwoSigmaCoverage = 0.9544997361036416;

/// The factor k with P(|t| <= k) = `coverage` for Student's t (GUM, table G.2). For infinite
/// degrees of freedom it is that of the normal distribution: 2 for kTwoSigmaCoverage. Uses
/// bisection to machine precision; not for the control cycle.
/// @param coverage  0 < coverage < 1
/// @param freedom   degrees of freedom, 1 or more; need not be whole
double StudentCoverageFactor(double coverage, double freedom);

}  // namespace plumbline::statistics
