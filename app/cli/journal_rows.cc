#include "app/cli/journal_rows.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

/// Null for a row that was never in quarantine.
const char* QuarantineText(cell::JournalRow::Quarantine quarantine) {
  switch (quarantine) {
    case cell::JournalRow::Quarantine::kNone:
      return nullptr;
    case cell::JournalRow::Quarantine::kWaiting:
      return "waiting";
    case cell::JournalRow::Quarantine::kAccepted:
      return "accepted";
    case cell::JournalRow::Quarantine::kRejected:
      return "rejected";
  }
  return nullptr;
}

}  // namespace

nlohmann::json JournalRowJson(const cell::JournalRow& row) {
  nlohmann::json json = {{"id", row.id},
                         {"source", NameOf(row.source)},
                         {"session", row.session},
                         {"wild", row.wild},
                         {"alarm", row.alarm}};
  const auto put = [&json](const char* name, const auto& value, double unit) {
    if (value) json[name] = static_cast<double>(*value) / unit;
  };
  const auto put_point = [&json](const char* name, const std::optional<Vec3>& p) {
    if (p) json[name] = {1e3 * p->x(), 1e3 * p->y(), 1e3 * p->z()};
  };
  for (const double q : row.q) json["q"].push_back(q / kRadPerDeg);
  if (!row.camera.empty()) json["camera"] = row.camera;
  if (const char* const state = QuarantineText(row.quarantine)) json["quarantine"] = state;
  if (row.unix_ms) json["unix_ms"] = *row.unix_ms;
  if (row.command) json["command"] = *row.command;
  if (row.model_version) json["model_version"] = *row.model_version;
  put("t_s", row.t_s, 1);
  put("payload_kg", row.payload_kg, 1);
  put("temp_C", row.temp_C, 1);
  if (row.tool_number) json["tool"] = *row.tool_number;
  if (row.payload_item) json["payload_item"] = *row.payload_item;
  put("range_mm", row.range_m, kMetrePerMm);
  if (!row.artefact.empty()) json["artefact"] = row.artefact;
  put("gauge_mm", row.gauge_m, kMetrePerMm);
  put("sigma_mm", row.sigma_m, kMetrePerMm);
  put_point("predicted_mm", row.predicted_W);
  put_point("measured_mm", row.measured_W);
  return json;
}

std::string JournalRowText(const cell::JournalRow& row) {
  std::string line = fmt::format("{:>6}  ", row.id);
  if (row.unix_ms) {
    line += fmt::format("{:%Y-%m-%d %H:%M:%S}Z",
                        fmt::gmtime(static_cast<std::time_t>(*row.unix_ms / 1000)));
  } else {
    line += row.t_s ? fmt::format("{:>18.3f} s", *row.t_s) : fmt::format("{:>20}", "-");
  }
  line += fmt::format(" {:<6}", NameOf(row.source));
  if (row.measured_W) {
    line += fmt::format(" {:>8.2f} {:>8.2f} {:>8.2f}", 1e3 * row.measured_W->x(),
                        1e3 * row.measured_W->y(), 1e3 * row.measured_W->z());
  } else if (row.range_m) {
    line += fmt::format(" {:>8.2f} {:>17}", 1e3 * *row.range_m, "(range)");
  } else if (row.gauge_m) {
    line += fmt::format(" {:>8.3f} {:>17}", 1e3 * *row.gauge_m, "(gauge)");
  } else {
    line += fmt::format(" {:>26}", "(touch)");
  }
  const bool compared = row.measured_W && row.predicted_W;
  line += fmt::format(
      " {:>11} {:>5}",
      compared ? fmt::format("{:.3f}", 1e3 * (*row.measured_W - *row.predicted_W).norm()) : "-",
      row.model_version ? std::to_string(*row.model_version) : "-");
  if (!row.artefact.empty()) line += "  on " + row.artefact;
  if (!row.camera.empty()) line += "  by " + row.camera;
  if (row.alarm) line += "  ALARM";
  if (row.wild) line += "  wild";
  if (const char* const state = QuarantineText(row.quarantine)) {
    line += fmt::format("  quarantine: {}", state);
  }
  return line;
}

std::string JournalHeader() {
  return fmt::format("{:>6}  {:<20} {:<6} {:>8} {:>8} {:>8} {:>11} {:>5}\n", "row", "time",
                     "source", "x mm", "y mm", "z mm", "residual mm", "model");
}

}  // namespace plumbline::cli
