// Intermediate results that the stages of a diagnosis pass to each other.
#pragma once

#include <cmath>
#include <string>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/refit.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/identify.h"
#include "app/measure/diagnosis/validation/held_out.h"

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
  InputUnits units{};  ///< of the distances of held-out rows
};

/// 3-D RMS over the rows that are not outliers.
inline double Rms(const PerRow<Vec3>& errors, const PerRow<double>& weights) {
  double sum = 0, count = 0;
  for (const RowIndex row : errors.indices()) {
    if (weights[row] < kOutlierWeight) continue;
    sum += errors[row].squaredNorm();
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}
/// 3-D RMS of the difference of errors over the rows that are not outliers.
inline double RmsBetween(PerRow<Vec3> a, const PerRow<Vec3>& b, const PerRow<double>& weights) {
  for (const RowIndex row : a.indices()) a[row] -= b[row];
  return Rms(a, weights);
}

/// Validates the model by held-out rows and decides which parts of it are written.
Result<CorrectedModel> Validated(const Task& task, const Identified& found, const FitOfAllRows& fit,
                                 Diagnosis& diagnosis);

/// Removes the correction if it must not be written.
void Withhold(const FittedModel& declared, CorrectedModel& corrected, Diagnosis& diagnosis);

/// True if nothing is open about the causes of the correction: no rival, no doubt, no discrepancy
/// model.
bool CausesConfirmed(const Diagnosis& diagnosis);

/// Reduces an unconfirmed correction to the share that predicts the rows held out by blocks of time
/// best (BestShare), or those of the first scheme that predicts any. All errors become those of
/// this share, which is the domain's applied_share; a share of 0 is withheld. Nothing is done if
/// the model will state no radius.
void ShrinkUnconfirmed(const Task& task, const Identified& found, const FitOfAllRows& fit,
                       const FittedModel& declared, CorrectedModel& corrected,
                       Diagnosis& diagnosis);

/// True if held-out rows can show the errors of new points: a region or a session was held out, and
/// not all rows are on artefacts that cannot show every error of the tip.
bool RadiusCanBeStated(const Task& task, const Validation& validation, const Diagnosis& diagnosis);

/// UTC at t_s = 0, if the cell states it.
inline std::optional<double> TimeZeroOf(const model::CellModel& cell) {
  return cell.domain ? cell.domain->time_zero_s : std::nullopt;
}

}  // namespace plumbline::measure
