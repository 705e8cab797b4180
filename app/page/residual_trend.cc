#include "app/page/residual_trend.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/journal/journal.h"

namespace plumbline {

Result<std::vector<TrendPoint>> ReadTrend(const std::string& state_directory,
                                          const std::vector<Joint>& joints) {
  const std::string file = state_directory + "/journal.sqlite";
  std::vector<TrendPoint> trend;
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return trend;
  Result<Journal> journal = Journal::OpenForReading(file);
  if (!journal) return Error{journal.error()};
  JournalFilter newest;
  newest.last = kTrendRows;
  const Result<bool> read = journal.value().ForEach(newest, joints, [&](const JournalRow& row) {
    if (!row.measured_W || !row.predicted_W) return;
    TrendPoint point;
    point.id = row.id;
    if (row.unix_ms) point.utc_s = 1e-3 * static_cast<double>(*row.unix_ms);
    point.residual_W = *row.measured_W - *row.predicted_W;
    point.model_version = row.model_version;
    point.wild = row.wild;
    point.alarm = row.alarm;
    trend.push_back(point);
  });
  if (!read) return Error{read.error()};
  return trend;
}

std::string TrendJson(const Result<std::vector<TrendPoint>>& trend) {
  nlohmann::ordered_json json;
  if (!trend) {
    json["problem"] = trend.error();
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
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
    json["points"].push_back(entry);
  }
  return json.dump();
}

}  // namespace plumbline
