// Intermediate results that the stages of a diagnosis pass to each other.
#pragma once

#include <string>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/held_out.h"
#include "app/measure/diagnosis/refit.h"

namespace plumbline::measure {

/// Input common to all stages.
struct Task {
  const Dataset& data;
  const DiagnosisOptions& options;

  void Report(double share, const std::string& what) const {
    if (options.progress) options.progress(share, what);
  }
  bool Interrupted() const { return options.interrupted && options.interrupted(); }
  static Error InterruptedError() { return Error{"interrupted"}; }
};

/// A model and its residuals.
struct FittedModel {
  Model model;
  PerRow<Vec3> errors;  ///< [m]
};

/// The identified model fitted to all rows, including those not used by the search.
struct FitOfAllRows {
  FitProblem problem;
  Refit refit;
  Linearisation linear;
  PerRow<Vec3> errors;  ///< residuals [m]
};

/// The model to be written, and its validation.
struct CorrectedModel {
  Model model;
  PerRow<Vec3> errors;    ///< [m]
  Validation validation;  ///< of the searched rows
  double discrepancy_parameters = 0;
};

/// 3-D RMS over the rows that are not outliers.
double Rms(const PerRow<Vec3>& errors, const PerRow<double>& weights);
/// 3-D RMS of the difference of errors over the rows that are not outliers.
double RmsBetween(PerRow<Vec3> a, const PerRow<Vec3>& b, const PerRow<double>& weights);

/// UTC at t_s = 0, if the cell states it.
std::optional<double> TimeZeroOf(const model::CellModel& cell);

}  // namespace plumbline::measure
