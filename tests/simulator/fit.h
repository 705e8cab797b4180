// Fit of the true model form to measured points by finite differences: a best-case reference for
// the diagnosis, and the design-matrix columns of every effect.
#pragma once

#include <Eigen/Core>

#include "tests/simulator/table.h"

namespace simulator {

/// One column: displacement of all tips (3 values per row) per unit of a parameter.
struct Column {
  std::string id, name, unit;
  std::vector<std::string> scope;
  Eigen::VectorXd slope_mm;
};

/// Columns of all effects of the exchange format that the table supports, evaluated at `effects`:
/// each parameter that is linear near zero, and sine and cosine for periodic ones.
std::vector<Column> Columns(const Cell& cell, const Effects& effects, const Table& table,
                            const std::vector<double>& cycles);

struct FitResult {
  Effects effects;
  double rms_m = 0.0;  ///< of the 3-D error over the rows
};

/// Least squares with Huber weights over all parameters of `form` that are not fixed, from the
/// given values (Levenberg-Marquardt). Unidentifiable directions remain unchanged.
FitResult Fit(const Cell& cell, const Effects& form, const Table& measured);

}  // namespace simulator
