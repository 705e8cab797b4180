// JSON parser front end: limits nesting, then parses. The product parses JSON only through it.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "app/text/nesting.h"
#include "firmware-like/result.h"

namespace plumbline::text {

/// The parsed value, or the error: "is not JSON", or the line where it is nested too deeply.
template <typename Json = nlohmann::json>
Result<Json> JsonFromText(std::string_view text) {
  if (const auto line = LineNestedTooDeepInJson(text)) {
    return Error{fmt::format("line {}: {}", *line, NestedTooDeepText())};
  }
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return Error{"is not JSON"};
  return json;
}

/// The same for callers that do not need the reason: null on error.
template <typename Json = nlohmann::json>
Json JsonOrNull(std::string_view text) {
  Result<Json> json = JsonFromText<Json>(text);
  return json ? std::move(json).value() : Json();
}

}  // namespace plumbline::text
