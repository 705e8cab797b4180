#include "app/journal/journal_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr double kMmPerMetre = 1 / kMetrePerMm;

/// One column: its name, what a row writes there (nothing: not recorded).
struct CsvColumn {
  std::string name;
  std::function<std::optional<std::string>(const JournalRow&)> text;
};

std::string Fixed(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

std::optional<std::string> FixedIfThere(const std::optional<double>& value, int decimals) {
  return value ? std::optional(Fixed(*value, decimals)) : std::nullopt;
}

void AddJoints(std::vector<CsvColumn>& columns, const std::vector<Joint>& joints,
               const char* prefix, const char* suffix, JointVector JournalRow::*values,
               int decimals) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool slides = joints[i].type == JointType::kPrismatic;
    const double unit = slides ? kMetrePerMm : kRadPerDeg;
    const auto index = static_cast<Eigen::Index>(i);
    columns.push_back({fmt::format("{}{}_{}{}", prefix, i + 1, slides ? "mm" : "deg", suffix),
                       [=](const JournalRow& row) -> std::optional<std::string> {
                         const JointVector& all = row.*values;
                         if (all.size() <= index) return std::nullopt;
                         return Fixed(all[index] / unit, decimals);
                       }});
  }
}

void AddTorques(std::vector<CsvColumn>& columns, const std::vector<Joint>& joints) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool slides = joints[i].type == JointType::kPrismatic;
    const auto index = static_cast<Eigen::Index>(i);
    columns.push_back({fmt::format("tau{}_{}", i + 1, slides ? "N" : "Nm"),
                       [=](const JournalRow& row) -> std::optional<std::string> {
                         if (row.tau.size() <= index) return std::nullopt;
                         return Fixed(row.tau[index], 4);
                       }});
  }
}

enum class Kind { kPosition, kRange, kPose, kNothing };

Kind KindOf(const JournalRow& row) {
  if (row.measured_W) return row.orientation_W ? Kind::kPose : Kind::kPosition;
  return row.range_m ? Kind::kRange : Kind::kNothing;
}

/// The kind of measured point that most rows have; a pose serves as a position.
Kind KindOfMost(const std::vector<JournalRow>& rows) {
  std::size_t positions = 0, poses = 0, ranges = 0;
  for (const JournalRow& row : rows) {
    const Kind kind = KindOf(row);
    positions += kind == Kind::kPosition || kind == Kind::kPose ? 1 : 0;
    poses += kind == Kind::kPose ? 1 : 0;
    ranges += kind == Kind::kRange ? 1 : 0;
  }
  if (ranges > positions) return Kind::kRange;
  return poses == positions && poses > 0 ? Kind::kPose : Kind::kPosition;
}

void AddMeasured(std::vector<CsvColumn>& columns, Kind kind) {
  if (kind == Kind::kRange) {
    columns.push_back({"range_mm", [](const JournalRow& row) {
                         return FixedIfThere(
                             row.range_m ? std::optional(*row.range_m * kMmPerMetre) : std::nullopt,
                             5);
                       }});
    return;
  }
  for (int k = 0; k < 3; ++k) {
    constexpr const char* kNames[] = {"x_mm", "y_mm", "z_mm"};
    columns.push_back({kNames[k], [k](const JournalRow& row) -> std::optional<std::string> {
                         if (!row.measured_W) return std::nullopt;
                         return Fixed((*row.measured_W)[k] * kMmPerMetre, 5);
                       }});
  }
  if (kind != Kind::kPose) return;
  for (int k = 0; k < 4; ++k) {
    constexpr const char* kNames[] = {"qw", "qx", "qy", "qz"};
    columns.push_back({kNames[k], [k](const JournalRow& row) -> std::optional<std::string> {
                         if (!row.orientation_W) return std::nullopt;
                         return Fixed(row.orientation_W->coeffs()[(k + 3) % 4], 9);
                       }});
  }
}

}  // namespace

std::vector<JournalRow> JournalRowsFrom(const MeasuredTable& table) {
  const RecordedColumns& recorded = table.recorded;
  std::vector<JournalRow> rows;
  for (const MeasuredRow& from : table.rows) {
    JournalRow& row = rows.emplace_back();
    row.source = JournalRow::Source::kImport;
    row.session = from.session;
    row.q = from.q;
    if (recorded.qd) row.qd = from.qd;
    if (recorded.qdd) row.qdd = from.qdd;
    if (recorded.tau) row.tau = from.tau;
    if (recorded.time) row.t_s = from.t_s;
    if (recorded.payload) row.payload_kg = from.payload_kg;
    if (recorded.temperature) row.temp_C = from.temp_C;
    if (recorded.position) row.measured_W = from.p_WT;
    if (recorded.range) row.range_m = from.range_m;
    if (recorded.orientation) row.orientation_W = from.q_WT;
    if (recorded.q_step) row.q_step_rad = from.q_step_rad;
  }
  return rows;
}

ExportedCsv CsvFromJournal(const std::vector<JournalRow>& all_rows,
                           const std::vector<Joint>& joints) {
  ExportedCsv exported;
  const Kind kind = KindOfMost(all_rows);
  std::vector<const JournalRow*> rows;
  for (const JournalRow& row : all_rows) {
    const bool fits = kind == Kind::kRange ? row.range_m.has_value() : row.measured_W.has_value();
    if (fits) {
      rows.push_back(&row);
      exported.ids.push_back(row.id);
    } else {
      exported.notes.push_back(fmt::format("row {}: left out, it has no {}", row.id,
                                           kind == Kind::kRange ? "range" : "position"));
    }
  }

  std::vector<CsvColumn> columns;
  columns.push_back({"session", [](const JournalRow& row) {
                       return row.session.empty() ? std::nullopt : std::optional(row.session);
                     }});
  const auto imported =
      static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), [](const JournalRow* row) {
        return row->source == JournalRow::Source::kImport && row->t_s;
      }));
  if (imported == 0 || imported == rows.size()) {
    columns.push_back({"t_s", [](const JournalRow& row) { return FixedIfThere(row.t_s, 6); }});
  } else {
    exported.notes.push_back(
        "column t_s: left out, imported rows count it from another moment than probes do");
  }
  AddJoints(columns, joints, "q", "", &JournalRow::q, 7);
  AddJoints(columns, joints, "qd", "_s", &JournalRow::qd, 6);
  AddJoints(columns, joints, "qdd", "_s2", &JournalRow::qdd, 6);
  AddTorques(columns, joints);
  columns.push_back(
      {"payload_kg", [](const JournalRow& row) { return FixedIfThere(row.payload_kg, 6); }});
  columns.push_back({"temp_C", [](const JournalRow& row) { return FixedIfThere(row.temp_C, 4); }});
  const bool coarse = std::any_of(rows.begin(), rows.end(), [](const JournalRow* row) {
    return row->q_step_rad.value_or(0) > 0;
  });
  if (coarse) {  // what is not known of a row counts as fine
    columns.push_back({"q_step_deg", [](const JournalRow& row) {
                         return std::optional(Fixed(row.q_step_rad.value_or(0) / kRadPerDeg, 7));
                       }});
  }
  AddMeasured(columns, kind);

  std::vector<CsvColumn> used;
  for (CsvColumn& column : columns) {
    const auto with = static_cast<std::size_t>(
        std::count_if(rows.begin(), rows.end(),
                      [&column](const JournalRow* row) { return column.text(*row).has_value(); }));
    if (with == rows.size() && with > 0) {
      used.push_back(std::move(column));
    } else if (with > 0) {
      exported.notes.push_back(fmt::format("column {}: left out, only {} of {} rows have it",
                                           column.name, with, rows.size()));
    }
  }
  const auto line = [&](auto field) {
    for (std::size_t i = 0; i < used.size(); ++i) {
      exported.text += (i == 0 ? "" : ",") + field(used[i]);
    }
    exported.text += '\n';
  };
  line([](const CsvColumn& column) { return column.name; });
  for (const JournalRow* row : rows) {
    line([row](const CsvColumn& column) { return *column.text(*row); });
  }
  return exported;
}

}  // namespace plumbline
