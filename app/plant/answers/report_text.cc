#include "app/plant/answers/report_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/plant/answers/state_words.h"

namespace plumbline::plant {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kTextColumns = 80, kWidestColumn = 26;

std::string TableText(const ReportTable& table) {
  std::vector<std::size_t> widths;
  for (std::size_t column = 0; column < table.heads.size(); ++column) {
    std::size_t width = terminal::ColumnsOf(table.heads[column]);
    for (const auto& row : table.rows) width = std::max(width, terminal::ColumnsOf(row[column]));
    widths.push_back(std::min(width, kWidestColumn));
  }
  const auto line = [&](const std::vector<std::string>& words) {
    std::string text;
    for (std::size_t k = 0; k < words.size(); ++k) {
      text += k + 1 < words.size() ? Padded(words[k], widths[k]) + "  " : words[k];
    }
    text.erase(text.find_last_not_of(' ') + 1);
    return terminal::WrappedLine(text, kTextColumns) + "\n";
  };
  std::string text = table.title + "\n";
  if (!table.rows.empty()) text += line(table.heads);
  for (const auto& row : table.rows) text += line(row);
  return text + terminal::WrappedParagraph(table.note, kTextColumns - 2, 2).insert(0, "  ") + "\n";
}

Json IntervalJson(const Interval& interval) {
  return {{"value", text::NumberJson(interval.value)},
          {"low", text::NumberJson(interval.low)},
          {"high", text::NumberJson(interval.high)}};
}

Json NamesJson(const ReportedCell& cell) {
  return {
      {"line", cell.line}, {"node", cell.node}, {"name", cell.name}, {"arm_model", cell.arm_model}};
}

Json GroupsJson(const std::vector<GroupAnswer>& groups) {
  Json list = Json::array();
  for (const GroupAnswer& group : groups) {
    Json json = {{"kind", group.kind}, {"name", group.name}, {"cells", group.cells}};
    json["median_mm"] = group.median_mm ? IntervalJson(group.median_mm->median) : Json(nullptr);
    json["p_adjusted"] = group.median_mm ? Json(group.p_adjusted) : Json(nullptr);
    list.push_back(json);
  }
  return list;
}

}  // namespace

std::string ReportText(const ReportData& data, const PlantReport& report) {
  std::string text = ReportHeading(data, report) + "\n";
  for (const ReportTable& table : TablesOf(data, report)) text += "\n" + TableText(table);
  return text;
}

std::string ReportJson(const ReportData& data, const PlantReport& report) {
  Json json = {{"schema", 1},
               {"first_day", DateText(data.period.first_day)},
               {"last_day", DateText(data.period.last_day)},
               {"compared_days", data.period.compared_days},
               {"cells", data.cells.size()},
               {"levels", Json::array()},
               {"drifts", Json::array()},
               {"not_tested_for_drift", report.too_few_days},
               {"never_significant", report.never_significant},
               {"detectable_mm_per_day",
                report.detectable_mm ? text::NumberJson(*report.detectable_mm) : Json(nullptr)},
               {"drift_groups", GroupsJson(report.drift_groups)},
               {"shifts", Json::array()},
               {"not_tested_for_shift", report.too_few_shift_days},
               {"shift_groups", GroupsJson(report.shift_groups)},
               {"maintenance", Json::array()},
               {"models", Json::array()},
               {"stale_lenses", Json::array()},
               {"diagnoses", Json::array()}};
  for (const CellLevel& level : report.levels) {
    Json one = NamesJson(*level.cell);
    one["level_mm"] = IntervalJson(level.level_mm);
    one["autocorrelation"] = level.autocorrelation;
    one["max_mm"] = text::NumberJson(level.max_mm);
    one["probes"] = level.probes;
    one["wild"] = level.wild;
    json["levels"].push_back(one);
  }
  for (const CellDrift& drift : report.drifts) {
    Json one = NamesJson(*drift.cell);
    one["days"] = drift.size_mm.days;
    one["size_mm_per_day"] = IntervalJson(drift.size_mm.slope);
    one["moves_mm_per_day"] = text::NumberJson(drift.moves_mm);
    one["p_adjusted"] = drift.p_adjusted;
    json["drifts"].push_back(one);
  }
  for (const CellShift& shift : report.shifts) {
    Json one = NamesJson(*shift.cell);
    one["days_before"] = shift.size_mm.days_before;
    one["days_after"] = shift.size_mm.days_after;
    one["difference_mm"] = IntervalJson(shift.size_mm.difference);
    one["other_model"] = shift.other_model;
    one["p_adjusted"] = shift.p_adjusted;
    json["shifts"].push_back(one);
  }
  for (const Maintenance& maintenance : report.maintenance) {
    Json one = NamesJson(*maintenance.cell);
    one["reduction_mm"] = IntervalJson(maintenance.reduction_mm);
    one["basis"] = maintenance.basis;
    json["maintenance"].push_back(one);
  }
  for (const ReportedCell& cell : data.cells) {
    Json one = NamesJson(cell);
    one["in_force"] = cell.model;
    one["proposed"] = cell.proposed_model > 0 ? Json(cell.proposed_model) : Json(nullptr);
    json["models"].push_back(one);
  }
  for (const StaleLens& lens : data.lenses) {
    json["stale_lenses"].push_back({{"line", lens.line},
                                    {"node", lens.node},
                                    {"name", lens.name},
                                    {"camera", lens.camera},
                                    {"reason", lens.reason}});
  }
  for (const DiagnosisAnswer& answer : data.diagnoses) {
    json["diagnoses"].push_back({{"line", answer.line},
                                 {"node", answer.node},
                                 {"name", answer.name},
                                 {"summary", answer.summary}});
  }
  return text::JsonText(json, 1) + "\n";
}

}  // namespace plumbline::plant
