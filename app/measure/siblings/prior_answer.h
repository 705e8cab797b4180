// Adjustment of an answer about a cell with the prior's effects, which the same rows updated.
#pragma once

#include <optional>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// True if the correction was withheld because held-out rows are not predicted better with it.
bool WithheldByHeldOutRows(const Diagnosis& diagnosis);

/// Removes what the rows show beyond the prior unless its causes are confirmed, with a note. That
/// no sibling shows it is evidence against it. A correction that fades with the distance from the
/// rows would take all effects of the cell with it, the siblings' included (ErrorGrowth).
void RemoveUnconfirmed(Diagnosis& with);

/// Held-out error of the model that an answer writes; nullopt if no row could be held out.
std::optional<double> HeldOutOf(const Diagnosis& answer);

/// Mean decrease of the squared held-out errors with the siblings, in units of its standard error;
/// nullopt with fewer than three rows. More than one is clearly better, less than -1 clearly worse
/// (a judgement; few rows rarely show more).
/// @param factor  applied to the errors with them
std::optional<double> GainInStandardErrors(const Diagnosis& with, const Diagnosis& without,
                                           double factor);

/// For p parameters fitted to n residuals, the RMS of new residuals over that of the fitted ones,
/// sqrt((n + p) / (n - p)); nullopt if there are too few residuals.
std::optional<double> FactorForNewRows(double parameters, const Diagnosis& diagnosis);

/// Widens every stated error of held-out rows and of new points, because those rows took part in
/// the update of the prior.
void Widen(double factor, Diagnosis& diagnosis);

/// Replaces the errors before correction by those under the declared cell, by line.
void StateErrorsBefore(const Diagnosis& without, Diagnosis& with);

}  // namespace plumbline::measure
