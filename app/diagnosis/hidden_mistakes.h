// Mistakes in cell or file that an effect beside them hides.
#pragma once

#include <optional>
#include <string>

#include "app/diagnosis/identify.h"

namespace plumbline {

/// Names a mistake that is smaller than what effects do (Mistake::subtle) where taking it back
/// leaves a sound explanation and the rows as they are have none: an answer with an implausible
/// value, an empirical term, or more left than the declared noise. Both are identified anew, on up
/// to 300 rows; the one with the mistake taken back must be better by kMistakeMargin.
/// @param found  the answer for the rows as they are
/// @return what is wrong and what to do; nothing where the answer is sound, or no mistake mends it
std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options);

}  // namespace plumbline
