// JSON files of the model store, and the facts in a diagnosis result.
#pragma once

#include <optional>
#include <string>

#include "app/cell/model_store/model_store.h"

namespace plumbline::cell {

inline constexpr int kModelSchema = 1;
/// Schema number in a file of the store; 0 if it has none.
int SchemaInJson(const std::string& text);

std::string JsonFrom(const ModelFacts& facts);
std::string JsonFrom(const ModelState& state);
/// nullopt if the text was not written by JsonFrom(), or its numbers are inconsistent.
std::optional<ModelFacts> ModelFactsFromJson(const std::string& text);
std::optional<ModelState> ModelStateFromJson(const std::string& text);

/// The facts in a DIAGNOSIS.json (docs/reference/files.md): verdict, effects, what is implausible
/// or unexplained, held-out error before and after (absent if nothing was held out).
/// @return  why it cannot be used
Result<ModelFacts> ModelFactsFromDiagnosis(const std::string& text);

}  // namespace plumbline::cell
