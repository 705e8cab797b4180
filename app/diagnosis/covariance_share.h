// In which share the covariances of effects that were fitted together count in a radius.
#pragma once

#include "app/diagnosis/identify.h"

namespace plumbline {

/// A written model has a covariance for each effect by itself. Where effects do nearly the same, or
/// frames do nearly what an effect does, each by itself is far less certain than what they predict
/// together: p parameters fitted to rows of unit variance predict these rows with variances that
/// sum to p, whatever the parameters are,
///   sum_k tr(J_k Sigma J_k^T) = p          [trace of the hat matrix],
/// and effect by effect to more. The ratio of the two, at most 1; 1 for ranges, for what cancels
/// along the wire need not across it.
/// @param discrepancy_parameters  that the written discrepancy model holds, whose covariances have
///                                been scaled so already; 0: there is none
double CovarianceShare(const Identified& found, double discrepancy_parameters);

}  // namespace plumbline
