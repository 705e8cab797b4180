// What held-out rows say of a model: its errors, and which of its parts they admit.
#pragma once

#include "app/diagnosis/held_out.h"

namespace plumbline::diagnosis {

/// Held-out predictions in every way that the rows allow, blocks of time first.
struct Validation {
  std::vector<HeldOut> ways;
  std::vector<HeldOutError> errors;  ///< of those ways in which any row was predicted
  /// From one half of the joint space to the other, where asked for; not among `ways`, for it
  /// admits and withholds nothing: what it finds wrong fades with the distance.
  std::optional<HeldOut> halves{};
  double lost_m = 0;  ///< by AddError: part of `errors`, not of the rows' own
};

/// Holds rows out by blocks of time, by regions of the joint space and by sessions, and by halves
/// of it where `with_halves`.
Validation Validate(const HeldOutInput& input, bool with_halves = false);

/// True where the discrepancy model lowers the error of held-out regions and, where there are
/// several, of held-out sessions; of blocks of time where neither could be held out.
bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights);

/// The same errors without the discrepancy model.
Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation);

/// Adds an error that the written model makes and the one held out did not, in squares.
void AddError(double lost_m, Validation& validation);

/// Why the correction must not be written: it predicts held-out rows worse than the declared model
/// does, or no row could be held out. Empty where it may be. A model with an empirical term must
/// not be worse in any way, others not between the rows.
std::string ReasonToWithhold(const Validation& validation, bool empirical);

}  // namespace plumbline::diagnosis
