// Adjustment of the errors stated by an answer whose sizes of effects come from siblings and were
// updated by its own rows.
#pragma once

#include <optional>

#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::measure {

/// For p parameters fitted to n residuals, the RMS of new residuals over that of the fitted ones,
/// sqrt((n + p) / (n - p)); nullopt if there are too few residuals.
std::optional<double> FactorForNewRows(double parameters, const Diagnosis& diagnosis);

/// Widens every stated error of held-out rows and of new points, because those rows took part in
/// the update of the prior.
void Widen(double factor, Diagnosis& diagnosis);

/// Held-out error of the model that an answer writes; nullopt if no row could be held out.
std::optional<double> HeldOutOf(const Diagnosis& answer);

/// Mean decrease of the squared held-out errors with the siblings, in units of its standard error;
/// nullopt with fewer than three rows. More than one is clearly better, less than -1 clearly worse
/// (a judgement; few rows rarely show more).
/// @param factor  applied to the errors with them
std::optional<double> GainInStandardErrors(const Diagnosis& with, const Diagnosis& without,
                                           double factor);

/// Replaces the errors before correction by those under the declared cell, by line.
void StateErrorsBefore(const Diagnosis& without, Diagnosis& with);

}  // namespace plumbline::measure
