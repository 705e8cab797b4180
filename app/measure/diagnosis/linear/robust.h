// Robust scale and Hampel weights of rows, the tail of F, and reproducible random numbers.
#pragma once

#include <cstdint>
#include <vector>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

// Tail of the F distribution and a reproducible random number generator.

/// Upper tail probability P(F_{d1,d2} > value).
double FisherTail(double value, double d1, double d2);
/// The value that F_{d1,d2} exceeds with this probability.
double FisherQuantile(double probability, double d1, double d2);

/// Random number generator with the same sequence on every platform [Steele et al. 2014,
/// splitmix64].
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next();
  double Uniform();      ///< in [0, 1)
  int Below(int count);  ///< in 0..count-1
  /// -1 or 1.
  double Sign() { return Next() >> 63 ? 1.0 : -1.0; }

 private:
  std::uint64_t state_;
};

/// Robust standard deviation of one axis from the median residual size of the rows; 0 if no row has
/// a measurement.
double RobustSigma(const Dataset& data, const PerRow<RowResidual>& residuals);

/// Standard deviation of the residuals on one axis [m], weighted as in the fit, without outliers,
/// and with the degrees of freedom that `parameters` leave.
double ResidualScatter(const FitProblem& problem, const PerRow<RowResidual>& residuals,
                       double parameters);

/// Median of the chi distribution with `count` degrees of freedom, 1..6.
double MedianOfChi(int count);

/// Hampel's three-part weight of a row with `count` residuals and a size (SizeOf) in sigmas: one up
/// to a size that one clean row in 2000 exceeds, then decreasing, zero for gross errors [Hampel et
/// al. 1986, sec. 2.6]. Clean rows have weight one, so that the chi2 statistic remains valid.
double HampelWeight(int count, double sigmas);
/// Twice the loss function of this weight: equal to chi2 while the weight is one, and bounded for
/// rejected rows (41 for a position).
double HampelLoss(int count, double sigmas);

/// The weight of each row; zero for rows without a measurement.
PerRow<double> HampelWeights(const Dataset& data, const PerRow<RowResidual>& residuals,
                             double sigma_m);
/// Sum of the losses of all rows.
double HampelLoss(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m);

/// Scale for HampelWeights: at least `sigma_m`, and large enough that at most one row in ten is an
/// outlier; a larger share is an effect instead.
double OutlierScale(const Dataset& data, const PerRow<RowResidual>& residuals, double sigma_m);

}  // namespace plumbline::measure
