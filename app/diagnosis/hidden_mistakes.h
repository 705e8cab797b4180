// Mistakes in cell or file that an effect beside them hides.
#pragma once

#include <optional>
#include <string>

#include "app/diagnosis/identify.h"

namespace plumbline {

/// Names a mistake that is smaller than what effects do (Mistake::subtle) where taking it back
/// leaves a sound explanation, with no implausible value, no empirical term and no more than the
/// declared noise, that is better than the one of the rows as they are by kMistakeMargin, whatever
/// that is. Both row sets are searched anew on at most 300 rows, and only where the effects of the
/// answer fit better already with the mistake corrected, and better than with a change beside it.
/// @param found  the answer for the rows as they are
/// @return what is wrong and what to do; nothing where no known mistake explains the rows better
std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options);

}  // namespace plumbline
