// Radius of the sphere that contains 95 % of a normal error in space.
#pragma once

#include "firmware-like/geometry/pose.h"

namespace plumbline::statistics {

/// Radius of the sphere that contains 95 % of a zero-mean normal error with covariance C [m^2].
/// |e|^2 is approximated by a chi^2_nu with a = tr(C^2)/tr(C), nu = tr(C)^2/tr(C^2) [Satterthwaite
/// 1946], and its quantile by the Wilson-Hilferty formula (chi_square.h). Within 2 % of the exact
/// radius for every C.
double RadiusHolding95Percent(const Mat3& covariance);

}  // namespace plumbline::statistics
