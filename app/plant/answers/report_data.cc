#include <fmt/format.h>

#include <map>

#include "app/plant/answers/plant_report.h"

namespace plumbline::plant {
namespace {

constexpr const char* kToday = "SELECT current_date - date '1970-01-01'";

// Text of `state` is cut to what a version number needs: see kCells of plant_status.cc.
constexpr const char* kReportedCells = R"sql(
SELECT cell, line, node, coalesce(nullif(name, ''), node), arm_model, arm_series,
       (current_date - installed) / 365.25, coalesce(model, 0),
       CASE WHEN state->>'proposed_model' ~ '^[0-9]{1,9}$' THEN state->>'proposed_model' ELSE '0' END
FROM cell ORDER BY line, node)sql";

constexpr const char* kDays = R"sql(
SELECT cell, day - date '1970-01-01', model, probes, wild, sum_mm, max_mm,
       sum_dx_mm, sum_dy_mm, sum_dz_mm
FROM cell_day WHERE day BETWEEN date '1970-01-01' + $1::int AND date '1970-01-01' + $2::int
ORDER BY cell, day, model)sql";

constexpr const char* kStaleLenses = R"sql(
SELECT line, node, coalesce(nullif(name, ''), node), left(camera, 100), left(reason, 200),
       extract(epoch FROM utc)
FROM camera_now JOIN cell USING (cell) WHERE lens = 'stale' ORDER BY utc)sql";

constexpr const char* kDiagnoses = R"sql(
SELECT DISTINCT ON (cell.cell) line, node, coalesce(nullif(cell.name, ''), node),
       left(concat_ws(': ', output->>'verdict', output->>'refused', (
         SELECT string_agg(effect->>'id', ', ') FROM jsonb_array_elements(
           CASE jsonb_typeof(output->'effects') WHEN 'array' THEN output->'effects' ELSE '[]' END)
           effect)), 300), extract(epoch FROM utc)
FROM job JOIN cell USING (cell) JOIN result USING (job)
WHERE kind = 'diagnose' AND failed IS NULL
ORDER BY cell.cell, utc DESC)sql";

ReportedCell ReportedCellAt(const Rows& rows, int k) {
  ReportedCell cell;
  cell.line = rows.Text(k, 1);
  cell.node = rows.Text(k, 2);
  cell.name = rows.Text(k, 3);
  cell.arm_model = rows.TextOrNull(k, 4).value_or("");
  cell.arm_series = rows.TextOrNull(k, 5).value_or("");
  cell.age_years = rows.NumberOrNull(k, 6);
  cell.model = static_cast<int>(rows.Integer(k, 7));
  cell.proposed_model = static_cast<int>(rows.Integer(k, 8));
  return cell;
}

DaySums DaySumsAt(const Rows& rows, int k) {
  DaySums day;
  day.day = static_cast<int>(rows.Integer(k, 1));
  day.model = static_cast<int>(rows.Integer(k, 2));
  day.probes = rows.Integer(k, 3);
  day.wild = rows.Integer(k, 4);
  day.sum_mm = rows.Number(k, 5);
  day.max_mm = rows.Number(k, 6);
  day.sum_dx_mm = rows.Number(k, 7);
  day.sum_dy_mm = rows.Number(k, 8);
  day.sum_dz_mm = rows.Number(k, 9);
  return day;
}

}  // namespace

Result<ReportData> ReadReportData(Connection& connection, int days, std::optional<int> since) {
  ReportData data;
  const auto today = connection.Run(kToday);
  if (!today) return today.failure();
  data.period.last_day = static_cast<int>(today->Integer(0, 0));
  data.period.first_day = since.value_or(data.period.last_day - days + 1);
  if (since) data.period.compared_days = days;

  const auto cells = connection.Run(kReportedCells);
  if (!cells) return cells.failure();
  std::map<std::int64_t, std::size_t> places;
  for (int k = 0; k < cells->size(); ++k) {
    places[cells->Integer(k, 0)] = data.cells.size();
    data.cells.push_back(ReportedCellAt(*cells, k));
  }
  const auto rows = connection.Run(
      kDays, {data.period.first_day - data.period.compared_days, data.period.last_day});
  if (!rows) return rows.failure();
  for (int k = 0; k < rows->size(); ++k) {
    const auto place = places.find(rows->Integer(k, 0));
    if (place != places.end()) data.cells[place->second].days.push_back(DaySumsAt(*rows, k));
  }
  const auto lenses = connection.Run(kStaleLenses);
  if (!lenses) return lenses.failure();
  for (int k = 0; k < lenses->size(); ++k) {
    data.lenses.push_back({std::string(lenses->Text(k, 0)), std::string(lenses->Text(k, 1)),
                           std::string(lenses->Text(k, 2)), std::string(lenses->Text(k, 3)),
                           std::string(lenses->Text(k, 4)), lenses->Number(k, 5)});
  }
  const auto diagnoses = connection.Run(kDiagnoses);
  if (!diagnoses) return diagnoses.failure();
  for (int k = 0; k < diagnoses->size(); ++k) {
    data.diagnoses.push_back({std::string(diagnoses->Text(k, 0)),
                              std::string(diagnoses->Text(k, 1)),
                              std::string(diagnoses->Text(k, 2)),
                              std::string(diagnoses->Text(k, 3)), diagnoses->Number(k, 4)});
  }
  return data;
}

}  // namespace plumbline::plant
