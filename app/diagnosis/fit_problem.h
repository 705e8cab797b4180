// What every fit of a diagnosis starts from: the rows that take part, their weights and the noise.
#pragma once

#include "app/diagnosis/dataset.h"

namespace plumbline {

/// Rows of a data set as one weighted least squares problem.
struct FitProblem {
  const Dataset& data;     ///< must outlive the problem
  FitRows rows;            ///< that take part; the others have no influence whatever
  PerRow<double> weights;  ///< of all rows, 0..1
  double sigma_m = 0;      ///< noise, one axis
  int threads = 1;
  double row_correlation = 0;  ///< of the noise of successive rows, 0..1

  FitLayout layout() const;
  /// The same data, weights and noise, with other rows taking part.
  FitProblem WithRows(FitRows other) const {
    return {data, std::move(other), weights, sigma_m, threads, row_correlation};
  }
};

/// Every row with its whole weight, and the noise of the data set.
FitProblem FitOfEveryRow(const Dataset& data, int threads);

}  // namespace plumbline
