#include "app/display/page/residual_trend.h"

#include <filesystem>

#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::display {
namespace {

/// Bounds the duration of the search.
constexpr std::int64_t kTrendSearchRows = 100'000;

/// Skips rows of another arm, quarantined rows, and rows without measurement or prediction.
constexpr const char* kSelectTrend =
    "SELECT * FROM (SELECT id, unix_ms, x_mm - predicted_x_mm, y_mm - predicted_y_mm,"
    " z_mm - predicted_z_mm, model_version, wild, alarm, payload_kg FROM measurement"
    " WHERE id > (SELECT coalesce(max(id), 0) FROM measurement) - ?3"
    " AND x_mm + y_mm + z_mm IS NOT NULL"
    " AND predicted_x_mm + predicted_y_mm + predicted_z_mm IS NOT NULL"
    " AND quarantine IN (0, 2)"
    " AND json_array_length(q) = ?1 ORDER BY id DESC LIMIT ?2) ORDER BY id";

}  // namespace

Result<std::vector<TrendPoint>> ReadTrend(const std::string& state_directory,
                                          const std::vector<model::Joint>& joints) {
  const std::string file = state_directory + "/journal.sqlite";
  std::vector<TrendPoint> trend;
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return trend;
  Result<cell::Journal> journal = cell::Journal::OpenForReading(file);
  if (!journal) return journal.failure();
  Result<sqlite::Database> database = sqlite::Database::Open(file, sqlite::Database::Mode::kRead);
  if (!database) return database.failure();
  sqlite::Statement rows(database.value().get(), kSelectTrend);
  rows.Bind(1, static_cast<std::int64_t>(joints.size()));
  rows.Bind(2, kTrendRows);
  rows.Bind(3, kTrendSearchRows);
  int code = SQLITE_ROW;
  while ((code = rows.Step()) == SQLITE_ROW) {
    TrendPoint point;
    point.id = rows.Integer(0);
    if (!rows.IsNull(1)) point.utc_s = 1e-3 * rows.Number(1);
    point.residual_W = kMetrePerMm * Vec3(rows.Number(2), rows.Number(3), rows.Number(4));
    if (!rows.IsNull(5)) point.model_version = static_cast<int>(rows.Integer(5));
    point.wild = rows.Integer(6) != 0;
    point.alarm = rows.Integer(7) != 0;
    if (!rows.IsNull(8)) point.payload_kg = rows.Number(8);
    trend.push_back(point);
  }
  if (code != SQLITE_DONE) return Error{file + ": " + database.value().Problem()};
  return trend;
}

std::string TrendJson(const Result<std::vector<TrendPoint>>& trend) {
  nlohmann::ordered_json json;
  if (!trend) {
    json["problem"] = trend.error();
    return text::JsonText(json);
  }
  json["points"] = nlohmann::ordered_json::array();
  for (const TrendPoint& point : *trend) {
    const Vec3 mm = 1e3 * point.residual_W;
    nlohmann::ordered_json entry = {{"id", point.id},
                                    {"mm", mm.norm()},
                                    {"xyz_mm", {mm.x(), mm.y(), mm.z()}},
                                    {"wild", point.wild},
                                    {"alarm", point.alarm}};
    if (point.utc_s) entry["utc_s"] = *point.utc_s;
    if (point.model_version) entry["model"] = *point.model_version;
    if (point.payload_kg) entry["payload_kg"] = *point.payload_kg;
    json["points"].push_back(entry);
  }
  return text::JsonText(json);
}

}  // namespace plumbline::display
