#include "app/plant/sparkplug/kept_points.h"

#include <optional>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"

namespace plumbline::plant {
namespace {

constexpr int kKeptSchema = 1;

nlohmann::json JsonOfValue(const MetricValue& value) {
  return std::visit(
      [](const auto& one) -> nlohmann::json {
        if constexpr (std::is_same_v<std::decay_t<decltype(one)>, std::monostate>) {
          return nullptr;
        } else {
          return one;
        }
      },
      value);
}

/// [name, type, value, time]
std::optional<std::pair<std::string, MetricStore::KeptValue>> KeptFromJson(
    const nlohmann::json& row) {
  if (!row.is_array() || row.size() != 4 || !row[0].is_string()) return std::nullopt;
  const auto type = text::IntegerFromJsonIfValid<std::uint32_t>(row[1]);
  const auto utc_ms = text::IntegerFromJsonIfValid<std::int64_t>(row[3]);
  if (!type || !utc_ms || *utc_ms <= 0) return std::nullopt;
  MetricStore::KeptValue kept{static_cast<DataType>(*type), {}, *utc_ms, Quality::kGood};
  if (row[2].is_null() || !TakeMetricValue(row[2], kept.type, kept.value)) return std::nullopt;
  return std::pair(row[0].get<std::string>(), std::move(kept));
}

}  // namespace

std::string TextOfKeptPoints(const KeptPoints& points) {
  nlohmann::json cells = nlohmann::json::array();
  std::size_t count = 0;
  for (const auto& [name, kept] : points) {
    nlohmann::json values = nlohmann::json::array();
    for (const auto& [metric, value] : kept.values) {
      if (count++ < kMaxKept)
        values.push_back({metric, static_cast<std::uint32_t>(value.type), JsonOfValue(value.value),
                          value.utc_ms});
    }
    cells.push_back({{"group", name.first},
                     {"node", name.second},
                     {"stream", kept.stream},
                     {"seq", kept.seq},
                     {"values", std::move(values)}});
  }
  return text::JsonText(nlohmann::json{{"schema", kKeptSchema}, {"cells", std::move(cells)}});
}

Result<KeptPoints> KeptPointsFromText(std::string_view text) {
  const auto parsed = text::JsonFromText(text);
  if (!parsed) return parsed.failure();
  const nlohmann::json& whole = *parsed;
  if (!whole.is_object() || whole.value("schema", nlohmann::json()) != kKeptSchema)
    return Error{"is of another version"};
  const auto cells = whole.find("cells");
  if (cells == whole.end() || !cells->is_array()) return Error{"has no list of cells"};
  KeptPoints points;
  for (const nlohmann::json& cell : *cells) {
    const auto text_at = [&](const char* key) {
      const auto found = cell.is_object() ? cell.find(key) : cell.end();
      return cell.is_object() && found != cell.end() && found->is_string()
                 ? found->get<std::string>()
                 : std::string();
    };
    const CellName name{text_at("group"), text_at("node")};
    const auto seq = cell.is_object() && cell.contains("seq")
                         ? text::IntegerFromJsonIfValid<std::int64_t>(cell["seq"])
                         : std::nullopt;
    const bool has_values =
        cell.is_object() && cell.contains("values") && cell["values"].is_array();
    if (name.first.empty() || name.second.empty() || !seq || !has_values)
      return Error{"has a cell of another form"};
    MetricStore::Kept& kept = points[name];
    kept.stream = text_at("stream");
    kept.seq = *seq;
    for (const nlohmann::json& value : cell["values"]) {
      if (auto read = KeptFromJson(value)) kept.values.insert(std::move(*read));
    }
  }
  return points;
}

}  // namespace plumbline::plant
