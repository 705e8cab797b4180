// Mistakes in cell or file that an effect beside them hides.
#pragma once

#include <optional>
#include <string>

#include "app/diagnosis/identify.h"

namespace plumbline::diagnosis {

using Progress = std::function<void(double, const std::string&)>;

/// Names a mistake that is smaller than what effects do (Mistake::subtle) where taking it back
/// leaves a sound explanation, with no implausible value, no empirical term and no more than the
/// declared noise, that is better than the one of the rows as they are by kMistakeMargin, whatever
/// that is. Both row sets are searched anew on at most 300 rows, and only where the effects of the
/// answer fit better already with the mistake corrected, and better than with a change beside it.
/// @param found  the answer for the rows as they are
/// @param tell   progress: a share of 0..1 and what is being done
/// @return what is wrong and what to do; nothing where no known mistake explains the rows better
std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options,
                                         const Progress& tell);

/// Names a column whose unit changes (UnitChanges) before anything is searched: as read, no few
/// effects fit, and a search for many takes long. Converted, the rows have a sound explanation; as
/// read, none of as many effects comes within kMistakeMargin of it, nor does its own with a size
/// beside. Asks only where the column's numbers suggest a change; on at most 300 rows.
/// @return  what is wrong and what to do
std::optional<std::string> HiddenUnitChange(const Dataset& data, const DiagnosisOptions& options,
                                            const Progress& tell);

}  // namespace plumbline::diagnosis
