// Weighted least squares problem over rows of a data set: participating rows, weights and noise.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// A weighted least squares problem over rows of a data set.
struct FitProblem {
  const Dataset& data;     ///< must outlive the problem
  FitRows rows;            ///< participating rows; others have no influence
  PerRow<double> weights;  ///< of all rows, 0..1
  double sigma_m = 0;      ///< standard deviation of the noise, one axis
  int threads = 1;
  double row_correlation = 0;  ///< correlation of the noise of successive rows, 0..1

  /// The residuals of the rows, then the equations of the nuisances as if they were one more row.
  FitLayout layout() const;
  /// The same data, weights and noise with other participating rows.
  FitProblem WithRows(FitRows other) const {
    return {data, std::move(other), weights, sigma_m, threads, row_correlation};
  }
  /// The same rows, weights and noise with other data about them, for example another cell.
  FitProblem WithData(const Dataset& other) const {
    return {other, rows, weights, sigma_m, threads, row_correlation};
  }
};

/// All rows with weight 1 (0 for rows without a measurement) and the noise of the data set.
FitProblem UnitWeightFit(const Dataset& data, int threads);

}  // namespace plumbline::measure
