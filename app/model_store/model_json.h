// The model store's small files, and what the diagnosis answers, as values.
#pragma once

#include <optional>
#include <string>

#include "app/model_store/model_store.h"

namespace plumbline {

inline constexpr int kModelSchema = 1;
/// The schema that a file of the store names; 0 where it names none.
int SchemaInJson(const std::string& text);

std::string JsonFrom(const ModelFacts& facts);
std::string JsonFrom(const ModelState& state);
/// Nothing where the text is not what JsonFrom() writes, or its numbers contradict each other.
std::optional<ModelFacts> ModelFactsFromJson(const std::string& text);
std::optional<ModelState> ModelStateFromJson(const std::string& text);

/// The facts in a DIAGNOSIS.json (formats.md): verdict, effects, what is implausible or unnamed,
/// held-out error before and after (absent where nothing was held out). @return why it cannot be
/// used
Result<ModelFacts> ModelFactsFromDiagnosis(const std::string& text);

}  // namespace plumbline
