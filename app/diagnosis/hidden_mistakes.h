// Mistakes in cell or file that an effect beside them hides.
#pragma once

#include <optional>
#include <string>

#include "app/diagnosis/identify.h"

namespace plumbline {

/// Names a mistake that is smaller than what effects do (Mistake::subtle) where taking it back
/// leaves a sound explanation, with no implausible value, no empirical term and no more than the
/// declared noise, that is better than the one of the rows as they are by kMistakeMargin. Both are
/// identified anew, on up to 300 rows, where the answer's own effects, or some of them, do better
/// with the mistake taken back.
/// @param found  the answer for the rows as they are
/// @return what is wrong and what to do; nothing where no mistake mends it
std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options);

}  // namespace plumbline
