// ISO 9283 characteristics of a diagnosis' rows before and after correction.
#pragma once

#include <optional>
#include <string>

#include "app/measure/accuracy/budget.h"
#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// Characteristics with one model, and the contributions to their uncertainties.
struct Achieved {
  Characteristics characteristics;
  Contributions contributions;

  Budget BudgetOfPose(std::size_t pose) const {
    return BudgetOf(characteristics, contributions, characteristics.poses[pose].cycles);
  }
};

/// Both have the same poses in the same order.
struct AchievedAccuracy {
  std::optional<Achieved> before;
  std::optional<Achieved> after;  ///< absent also if no correction was found or written
  std::string why_none;           ///< why `before` is absent
  /// True if the errors are those of rows that were used neither to select nor to fit the effects.
  bool held_out = false;
  int rows = 0;           ///< rows that are used
  int rejected_rows = 0;  ///< outliers among the rows that measure a position; they are not used
  int other_rows = 0;     ///< rows that do not measure a position, such as touches of artefacts
  /// The instrument's frame, or the tool's tip, was fitted to the measured points (without the rows
  /// held out, if any): an error of the base or of the tip that these absorb is not seen.
  bool frame_fitted = false, tip_fitted = false;
  bool noise_refuted = false;  ///< the residual is too large for the declared noise
};

/// "the instrument's frame and the tool's tip"; empty if nothing was fitted.
std::string FittedText(const AchievedAccuracy& achieved);

/// Only rows that measure the position of the TCP are used: a touch of an artefact shows an error
/// relative to a place that is estimated itself, or along one direction only. Rows rejected as
/// outliers are excluded. If rows were held out, only those are used, with their
/// held-out errors.
AchievedAccuracy AchievedAccuracyOf(const Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::measure
