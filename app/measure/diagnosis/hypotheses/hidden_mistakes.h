// Detection of mistakes in the cell or the file that are hidden by an effect.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/search/identify.h"

namespace plumbline::measure {

using Progress = std::function<void(double, const std::string&)>;

/// Looks for a mistake that moves the tip less than effects do (Mistake::subtle). It is reported if
/// correcting it leads to a sound explanation (no implausible value, no empirical term, residual
/// within the declared noise) that is better by kMistakeMargin than the explanation of the
/// uncorrected rows. Both are searched on at most 300 rows, and only if correcting the mistake
/// already improves the fit of the answer's effects, and by more than an alternative change.
/// @param found     the answer for the uncorrected rows, or for an evenly spaced subset of them
/// @param data      all rows
/// @param progress  completed share 0..1 and current activity
/// @return          the mistake and a remedy; nullopt if no known mistake explains the rows better
std::optional<std::string> HiddenMistake(const Identified& found, const Dataset& data,
                                         const DiagnosisOptions& options, const Progress& progress);

/// Looks for a column whose unit changes (UnitChanges), and for temperatures in Fahrenheit, before
/// the main search, which would be slow: no small number of effects fits the rows as read. A change
/// is reported if the converted rows have a sound explanation, and neither the rows as read with as
/// many effects nor an alternative conversion factor comes within kMistakeMargin of it. Searches
/// only if the numbers of the column suggest a change, on at most 300 rows.
/// @return  the mistake and a remedy; nullopt if there is none
std::optional<std::string> HiddenUnitChange(const Dataset& data, const DiagnosisOptions& options,
                                            const Progress& progress);

}  // namespace plumbline::measure
