// Robust weights of rows.
#pragma once

#include "app/diagnosis/linearisation.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline {

/// One axis's standard deviation from the middle of the rows' residuals; outliers do not raise it.
double RobustSigma(const PerRow<Vec3>& residuals, int axes);

/// Hampel's three-part weights on |r|/sigma: one up to a size that one clean row in 2000 exceeds,
/// falling then, zero for gross errors [Hampel et al. 1986, sec. 2.6]. Clean rows keep their whole
/// weight, so that chi2 keeps its meaning.
PerRow<double> HampelWeights(const PerRow<Vec3>& residuals, double sigma_m, int axes);

/// Twice the loss that these weights belong to, summed: chi2 where every row has its whole weight,
/// at most 41 for a rejected one.
double HampelLoss(const PerRow<Vec3>& residuals, double sigma_m, int axes);

/// The scale for HampelWeights: at least `sigma_m`, and large enough that no more than one row in
/// ten is taken for an outlier; more of them are an effect, not outliers.
double OutlierScale(const PerRow<Vec3>& residuals, double sigma_m, int axes);

}  // namespace plumbline
