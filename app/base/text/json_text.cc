#include "app/base/text/json_text.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "app/base/text/text.h"

template class nlohmann::basic_json<>;
template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace plumbline::text {

template <typename Json>
Result<Json> JsonFromText(std::string_view text) {
  if (const auto line = LineNestedTooDeepInJson(text)) {
    return Error{fmt::format("line {}: {}", *line, NestedTooDeepText())};
  }
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return Error{"is not JSON"};
  return json;
}
template Result<nlohmann::json> JsonFromText(std::string_view);
template Result<nlohmann::ordered_json> JsonFromText(std::string_view);

template <typename Json>
Json JsonOrNull(std::string_view text) {
  Result<Json> json = JsonFromText<Json>(text);
  return json ? std::move(json).value() : Json();
}
template nlohmann::json JsonOrNull(std::string_view);
template nlohmann::ordered_json JsonOrNull(std::string_view);

std::string JsonText(const nlohmann::json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string JsonText(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

nlohmann::ordered_json NumberJson(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

}  // namespace plumbline::text
