// The one way from a text to JSON: every file, row and message is read through it.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "app/text/nesting.h"
#include "firmware-like/result.h"

namespace plumbline {

/// The value, or why there is none: "is not JSON", or the line where it nests too deeply.
template <typename Json = nlohmann::json>
Result<Json> JsonFromText(std::string_view text) {
  if (const auto line = LineNestedTooDeepInJson(text)) {
    return Error{fmt::format("line {}: {}", *line, NestedTooDeepText())};
  }
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return Error{"is not JSON"};
  return json;
}

/// The same where the reason does not matter: null, which is no object and no array.
template <typename Json = nlohmann::json>
Json JsonOrNull(std::string_view text) {
  Result<Json> json = JsonFromText<Json>(text);
  return json ? std::move(json).value() : Json();
}

}  // namespace plumbline
