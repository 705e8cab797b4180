// Validation of a model by held-out rows: its errors, and which of its parts are accepted.
#pragma once

#include "app/measure/diagnosis/held_out.h"

namespace plumbline::measure {

/// Held-out predictions for every fold plan that the rows permit.
struct Validation {
  std::vector<HeldOut> schemes;      ///< blocks of time first
  std::vector<HeldOutError> errors;  ///< of the schemes with predicted rows
  /// Prediction from one half of the joint space to the other, if requested. Not one of `schemes`,
  /// since it decides on no part of the model: it only determines how the correction fades with the
  /// distance.
  std::optional<HeldOut> halves{};
  double added_error_m =
      0;  ///< from AddError: included in `errors`, not in the residuals of the rows
};

/// Holds rows out by blocks of time, regions of the joint space and sessions, and if `with_halves`,
/// by halves of the joint space.
Validation Validate(const HeldOutInput& input, bool with_halves = false);

/// True if the discrepancy model reduces the error of held-out regions and of held-out sessions; if
/// neither could be held out, that of blocks of time.
bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights);

/// Recomputes the errors without the discrepancy model.
Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation);

/// Adds, in squares, an error that the written model has in addition to the held-out ones.
void AddError(double added_error_m, Validation& validation);

/// Reason why the correction must not be written: it predicts held-out rows worse than the declared
/// model, or no row could be held out. Empty if it may be written. With an empirical term, no
/// scheme may be worse; otherwise, only the prediction between the rows (blocks of time) is
/// decisive.
std::string ReasonToWithhold(const Validation& validation, bool empirical);

}  // namespace plumbline::measure
