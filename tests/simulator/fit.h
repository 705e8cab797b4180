// The same model fitted to measured points, by finite differences: what somebody reaches who knows
// the true form, and the columns of every effect for plain rivals.
#pragma once

#include <Eigen/Core>

#include "tests/simulator/table.h"

namespace simulator {

/// A column block: displacement of all tips (3 a row) per unit of a parameter.
struct Column {
  std::string id, name, unit;
  std::vector<std::string> scope;
  Eigen::VectorXd slope_mm;
};

/// Columns of all effects of the exchange format at `effects`, for as many as the table records:
/// each parameter that is linear near zero, sine and cosine for what is periodic.
std::vector<Column> Columns(const Cell& cell, const Effects& effects, const Table& table,
                            const std::vector<double>& cycles);

struct FitResult {
  Effects effects;
  double rms_m = 0.0;  ///< of the 3-D error over the rows
};

/// Least squares with Huber weights over all parameters of `form` that are not fixed, from the
/// values given (Levenberg-Marquardt). Directions that the rows do not show stay where they are.
FitResult Fit(const Cell& cell, const Effects& form, const Table& measured);

}  // namespace simulator
