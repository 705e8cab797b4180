// Parsing and writing of JSON text. The product parses and writes JSON only through these
// functions; their templates are compiled once, in json_text.cc.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "firmware-like/result.h"

extern template class nlohmann::basic_json<>;
extern template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace plumbline::text {

/// The parsed value, or the error: "is not JSON", or the line where it is nested too deeply.
/// Defined for nlohmann::json and nlohmann::ordered_json.
template <typename Json = nlohmann::json>
Result<Json> JsonFromText(std::string_view text);

/// The same for callers that do not need the reason: null on error.
template <typename Json = nlohmann::json>
Json JsonOrNull(std::string_view text);

/// The value as UTF-8 text, on one line or indented by `indent` spaces per level. Bytes that are
/// not UTF-8 become U+FFFD.
std::string JsonText(const nlohmann::json& json, int indent = -1);
std::string JsonText(const nlohmann::ordered_json& json, int indent = -1);

/// The number; null if it is not finite.
nlohmann::ordered_json NumberJson(double value);

}  // namespace plumbline::text
