// Test of the mean residual of probes against the 95 % radius that was stated for them.
#pragma once

namespace plumbline::monitor {

/// True if the mean residual proves that the stated radius does not contain the mean error: it is
/// farther from zero than 99.99 % of the means that probes with an error of exactly `radius_m`
/// would have. For a mean m of N probes with scatter sigma per axis, s = sigma / sqrt(N), and an
/// error of length U in any direction, |m| / s is noncentral chi with 3 degrees of freedom:
///   P(|m| > x) = (erfc(a) + erfc(b)) / 2 + s / (U sqrt(2 pi)) (exp(-a^2) - exp(-b^2)),
///   a = (x - U) / (s sqrt 2),  b = (x + U) / (s sqrt 2)
/// @param mean_m           length of the mean residual
/// @param radius_m         stated 95 % radius U; without one (0) nothing is contradicted
/// @param sigma_of_mean_m  s, per axis; positive
bool ContradictsRadius(double mean_m, double radius_m, double sigma_of_mean_m);

}  // namespace plumbline::monitor
