// Robust weights of rows.
#pragma once

#include "app/diagnosis/linearisation.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline {

/// One axis's standard deviation from the middle of the rows' residuals; outliers do not raise it.
/// 0 where no row measures anything.
double RobustSigma(const Dataset& data, const PerRow<RowResidual>& residuals);

/// Median of the length of `count` independent normal numbers, 1..6.
double MedianOfChi(int count);

/// Hampel's three-part weight of a row of `count` residuals whose size (SizeOf) is so many sigmas:
/// one up to a size that one clean row in 2000 exceeds, falling then, zero for gross errors [Hampel
/// et al. 1986, sec. 2.6]. Clean rows keep their whole weight, so that chi2 keeps its meaning.
double HampelWeight(int count, double sigmas);
/// Twice the loss that this weight belongs to: chi2 where the weight is whole, bounded for a
/// rejected row (41 of a position).
double HampelLoss(int count, double sigmas);

/// The weight of each row; zero where it measures nothing.
PerRow<double> HampelWeights(const Dataset& data, const PerRow<RowResidual>& residuals,
                             double sigma_m);
/// The losses of all rows, summed.
double HampelLoss(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m);

/// The scale for HampelWeights: at least `sigma_m`, and large enough that no more than one row in
/// ten is taken for an outlier; more of them are an effect, not outliers.
double OutlierScale(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m);

}  // namespace plumbline
