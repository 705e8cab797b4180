#include "app/cell/journal/journal_csv.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>

#include "app/base/config/toml_reader.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::cell {
namespace {

constexpr std::size_t kNewestRows = 50;  // contain the rows that raised an alarm

/// One column: its name, and its text for a row (nullopt: not recorded).
struct CsvColumn {
  std::string name;
  std::function<std::optional<std::string>(const JournalRow&)> text;
  std::string recorded_as = {};  ///< name in notes on missing values; empty: the name
  bool may_be_empty = false;     ///< an empty cell means "not measured in this row"
};

std::string Fixed(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

std::optional<std::string> FixedIfThere(const std::optional<double>& value, int decimals) {
  return value ? std::optional(Fixed(*value, decimals)) : std::nullopt;
}

/// Adds one column for each joint.
void AddJoints(std::vector<CsvColumn>& columns, const std::vector<model::Joint>& joints,
               model::JointQuantity quantity, model::JointVector JournalRow::*values,
               int decimals) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::JointType type = joints[i].type;
    const double unit = model::FormOf(quantity, type).to_SI;
    const auto index = static_cast<Eigen::Index>(i);
    columns.push_back({model::JointColumnName(quantity, type, static_cast<int>(i)),
                       [=](const JournalRow& row) -> std::optional<std::string> {
                         const model::JointVector& all = row.*values;
                         if (all.size() <= index) return std::nullopt;
                         return Fixed(all[index] / unit, decimals);
                       },
                       model::JointColumnName(quantity, type, 0) + ".."});
  }
}

/// t_s on one clock: imported rows count it from their file's origin, probes from the journal's
/// epoch.
CsvColumn TimeColumn(const std::vector<const JournalRow*>& rows, bool& two_clocks) {
  const auto imported = [](const JournalRow& row) {
    return row.source == JournalRow::Source::kImport;
  };
  std::ptrdiff_t of_imports = 0, of_probes = 0;
  for (const JournalRow* row : rows) {
    if (row->t_s) ++(imported(*row) ? of_imports : of_probes);
  }
  two_clocks = of_imports > 0 && of_probes > 0;
  const bool imports = of_imports >= of_probes;
  return {"t_s",
          [imports, imported](const JournalRow& row) {
            return imported(row) == imports ? FixedIfThere(row.t_s, 6) : std::nullopt;
          },
          two_clocks ? "t_s of the same clock" : ""};
}

/// Whether the rows to be left out are under a tenth of all, and under a tenth of the newest rows,
/// which are the ones to be diagnosed.
bool AreFew(const std::vector<bool>& left_out) {
  const auto under_a_tenth = [&](std::size_t newest) {
    const auto first = left_out.end() - static_cast<std::ptrdiff_t>(newest);
    const auto count = static_cast<std::size_t>(std::count(first, left_out.end(), true));
    return 10 * count < newest;
  };
  return under_a_tenth(left_out.size()) && under_a_tenth(std::min(kNewestRows, left_out.size()));
}

std::string LeftOutNote(const std::vector<std::int64_t>& ids, const std::string& lacking) {
  return ids.size() == 1 ? fmt::format("row {}: left out, it has no {}", ids.front(), lacking)
                         : fmt::format("{} rows, starting with row {}: left out, they have no {}",
                                       ids.size(), ids.front(), lacking);
}

/// Selects the columns to be exported, and removes from `rows` the few that lack one of them; notes
/// both.
std::vector<CsvColumn> SelectColumns(std::vector<CsvColumn> columns, bool two_clocks,
                                     std::vector<const JournalRow*>& rows,
                                     std::vector<std::string>& notes) {
  struct Lack {
    std::size_t column;
    std::vector<bool> by_row;
    std::ptrdiff_t count;
  };
  std::vector<Lack> lacks;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    Lack& lack = lacks.emplace_back(Lack{c, {}, 0});
    for (const JournalRow* row : rows) lack.by_row.push_back(!columns[c].text(*row));
    const bool absent =
        std::find(lack.by_row.begin(), lack.by_row.end(), false) == lack.by_row.end();
    if (columns[c].may_be_empty && !absent) lack.by_row.assign(rows.size(), false);
    lack.count = std::count(lack.by_row.begin(), lack.by_row.end(), true);
  }
  // Most complete columns first, because each may exclude further rows.
  std::stable_sort(lacks.begin(), lacks.end(),
                   [](const Lack& a, const Lack& b) { return a.count < b.count; });
  std::vector<bool> left_out(rows.size(), false), kept(columns.size(), false);
  for (const Lack& lack : lacks) {
    const CsvColumn& column = columns[lack.column];
    const auto with = static_cast<std::ptrdiff_t>(rows.size()) - lack.count;
    if (with == 0) continue;
    std::vector<bool> further = left_out;
    for (std::size_t k = 0; k < rows.size(); ++k) further[k] = further[k] || lack.by_row[k];
    if (further == left_out || AreFew(further)) {
      left_out = std::move(further);
      kept[lack.column] = true;
    } else if (column.name == "t_s" && two_clocks) {
      notes.emplace_back(
          "column t_s: left out, imported rows count it from another origin than probes do");
    } else {
      notes.push_back(fmt::format("column {}: left out, only {} of {} rows have it", column.name,
                                  with, rows.size()));
    }
  }
  std::map<std::string, std::vector<std::int64_t>> ids_lacking;
  std::vector<const JournalRow*> whole;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!left_out[k]) {
      whole.push_back(rows[k]);
      continue;
    }
    std::vector<std::string> lacking;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (!kept[c] || columns[c].may_be_empty || columns[c].text(*rows[k])) continue;
      const std::string& as = columns[c].recorded_as;
      const std::string& name = as.empty() ? columns[c].name : as;
      if (lacking.empty() || lacking.back() != name) lacking.push_back(name);
    }
    ids_lacking[fmt::format("{}", fmt::join(lacking, ", "))].push_back(rows[k]->id);
  }
  for (const auto& [lacking, ids] : ids_lacking) {
    notes.push_back(LeftOutNote(ids, lacking) + ", unlike the others");
  }
  rows = std::move(whole);
  std::vector<CsvColumn> used;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (kept[c]) used.push_back(std::move(columns[c]));
  }
  return used;
}

std::optional<std::string> MillimetresIfThere(const std::optional<double>& length_m) {
  return length_m ? std::optional(Fixed(*length_m * kMmPerMetre, 5)) : std::nullopt;
}

enum class Kind { kPosition, kRange, kPose, kNothing };

Kind KindOf(const JournalRow& row) {
  if (row.measured_W) return row.orientation_W ? Kind::kPose : Kind::kPosition;
  return row.range_m ? Kind::kRange : Kind::kNothing;
}

/// A measured position outranks the artefact that the row names, as in the diagnosis.
bool IsOnArtefact(const JournalRow& row) {
  return !row.artefact.empty() && !row.measured_W;
}

/// The kind of measured point that most rows without an artefact have; a pose serves as a position.
Kind KindOfMost(const std::vector<JournalRow>& rows) {
  std::size_t positions = 0, poses = 0, ranges = 0;
  for (const JournalRow& row : rows) {
    if (IsOnArtefact(row)) continue;
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
    columns.push_back(
        {"range_mm", [](const JournalRow& row) { return MillimetresIfThere(row.range_m); }});
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

/// Adds the numbers of tool and payload item where any row has them.
void AddNumbers(std::vector<CsvColumn>& columns, const std::vector<const JournalRow*>& rows) {
  const auto add = [&](const char* name, std::optional<int> JournalRow::*number) {
    const bool any = std::any_of(rows.begin(), rows.end(),
                                 [&](const JournalRow* row) { return (row->*number).has_value(); });
    if (!any) return;
    columns.push_back({name,
                       [number](const JournalRow& row) -> std::optional<std::string> {
                         if (!(row.*number)) return std::nullopt;
                         return std::to_string(*(row.*number));
                       },
                       "", true});
  };
  add("tool", &JournalRow::tool_number);
  add("payload_item", &JournalRow::payload_item);
}

/// Adds the columns of rows on artefacts, of cameras and of single rows' uncertainty where any row
/// has them.
/// Measured columns may then be empty, since rows of several kinds are exported together.
void AddArtefacts(std::vector<CsvColumn>& columns, std::size_t first_measured, Kind kind,
                  const std::vector<const JournalRow*>& rows) {
  const auto any = [&rows](auto has) {
    return std::any_of(rows.begin(), rows.end(), [&](const JournalRow* row) { return has(*row); });
  };
  if (any([](const JournalRow& row) { return !row.artefact.empty(); })) {
    for (std::size_t k = first_measured; k < columns.size(); ++k) columns[k].may_be_empty = true;
    columns.push_back({"artefact",
                       [](const JournalRow& row) {
                         return row.artefact.empty() ? std::nullopt : std::optional(row.artefact);
                       },
                       "", true});
    const auto ranges = [](const JournalRow& row) {
      return IsOnArtefact(row) && row.range_m.has_value();
    };
    if (kind != Kind::kRange && any(ranges)) {
      columns.push_back({"range_mm",
                         [](const JournalRow& row) { return MillimetresIfThere(row.range_m); }, "",
                         true});
    }
    if (any([](const JournalRow& row) { return row.gauge_m.has_value(); })) {
      columns.push_back({"gauge_mm",
                         [](const JournalRow& row) { return MillimetresIfThere(row.gauge_m); }, "",
                         true});
    }
  }
  if (any([](const JournalRow& row) { return !row.camera.empty(); })) {
    columns.push_back({"camera",
                       [](const JournalRow& row) {
                         return row.camera.empty() ? std::nullopt : std::optional(row.camera);
                       },
                       "", true});
  }
  if (any([](const JournalRow& row) { return row.sigma_m.has_value(); })) {
    columns.push_back({"sigma_mm",
                       [](const JournalRow& row) { return MillimetresIfThere(row.sigma_m); }, "",
                       true});
  }
}

}  // namespace

std::vector<JournalRow> JournalRowsFrom(const measure::MeasuredTable& table) {
  std::vector<JournalRow> rows;
  for (const measure::MeasuredRow& from : table.rows) {
    JournalRow& row = rows.emplace_back();
    row.source = JournalRow::Source::kImport;
    row.session = from.session;
    static_cast<model::MeasuredPoint&>(row) = from;
  }
  return rows;
}

ExportedCsv CsvFromJournal(const std::vector<JournalRow>& all_rows,
                           const std::vector<model::Joint>& joints) {
  ExportedCsv exported;
  const Kind kind = KindOfMost(all_rows);
  std::vector<const JournalRow*> rows;
  std::vector<std::int64_t> without_point;
  for (const JournalRow& row : all_rows) {
    const bool fits = IsOnArtefact(row) ||
                      (kind == Kind::kRange ? row.range_m.has_value() : row.measured_W.has_value());
    if (fits) {
      rows.push_back(&row);
    } else {
      without_point.push_back(row.id);
    }
  }
  if (!without_point.empty()) {
    exported.notes.push_back(
        LeftOutNote(without_point, kind == Kind::kRange ? "range" : "position"));
  }

  std::vector<CsvColumn> columns;
  columns.push_back({"session", [](const JournalRow& row) {
                       return row.session.empty() ? std::nullopt : std::optional(row.session);
                     }});
  bool two_clocks = false;
  columns.push_back(TimeColumn(rows, two_clocks));
  AddJoints(columns, joints, model::JointQuantity::kPosition, &JournalRow::q, 7);
  AddJoints(columns, joints, model::JointQuantity::kVelocity, &JournalRow::qd, 6);
  AddJoints(columns, joints, model::JointQuantity::kAcceleration, &JournalRow::qdd, 6);
  AddJoints(columns, joints, model::JointQuantity::kTorque, &JournalRow::tau, 4);
  columns.push_back(
      {"payload_kg", [](const JournalRow& row) { return FixedIfThere(row.payload_kg, 6); }});
  AddNumbers(columns, rows);
  columns.push_back({"temp_C", [](const JournalRow& row) { return FixedIfThere(row.temp_C, 4); }});
  const bool coarse = std::any_of(rows.begin(), rows.end(), [](const JournalRow* row) {
    return row->q_step_rad.value_or(0) > 0;
  });
  if (coarse) {  // rows without a known resolution count as fine
    columns.push_back({"q_step_deg", [](const JournalRow& row) {
                         return std::optional(Fixed(row.q_step_rad.value_or(0) / kRadPerDeg, 7));
                       }});
  }
  const std::size_t first_measured = columns.size();
  AddMeasured(columns, kind);
  AddArtefacts(columns, first_measured, kind, rows);

  const std::vector<CsvColumn> used =
      SelectColumns(std::move(columns), two_clocks, rows, exported.notes);
  const auto line = [&](auto field) {
    for (std::size_t i = 0; i < used.size(); ++i) {
      exported.text += (i == 0 ? "" : ",") + field(used[i]);
    }
    exported.text += '\n';
  };
  line([](const CsvColumn& column) { return column.name; });
  for (const JournalRow* row : rows) {
    exported.ids.push_back(row->id);
    line([row](const CsvColumn& column) { return column.text(*row).value_or(""); });
  }
  return exported;
}

}  // namespace plumbline::cell
