#include "app/plant/jobs/cell_data.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "app/base/config/cell_reader.h"
#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/cell/journal/journal_csv.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;

/// The newest first, so that a limit keeps these.
constexpr const char* kSelectRows = R"sql(
SELECT journal, id, (extract(epoch FROM utc) * 1000)::bigint, source, session, x_mm, y_mm, z_mm,
       payload_kg, temp_c, to_json(q), more
FROM probe
WHERE cell = $1 AND q IS NOT NULL
  AND ($2::timestamptz IS NULL OR utc >= $2) AND ($3::timestamptz IS NULL OR utc <= $3)
  AND ($4::int IS NULL OR model = $4) AND ($5 OR NOT quarantined)
ORDER BY utc DESC, stream DESC, seq DESC LIMIT $6
)sql";

Parameter TextOrNull(const std::string& text) {
  return text.empty() ? Parameter(std::nullopt) : Parameter(text);
}

std::optional<double> NumberIn(const json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<int> WholeIn(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : text::IntegerFromJsonIfValid<int>(*found);
}

/// Joint values in SI units; empty if they are not as many as the joints.
model::JointVector JointsFrom(const json& numbers, const std::vector<model::Joint>& joints,
                              model::JointQuantity quantity) {
  if (!numbers.is_array() || numbers.size() != joints.size()) return {};
  model::JointVector values(static_cast<Eigen::Index>(joints.size()));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!numbers[i].is_number()) return {};
    values[static_cast<Eigen::Index>(i)] =
        numbers[i].get<double>() * model::FormOf(quantity, joints[i].type).to_SI;
  }
  return values;
}

/// w, x, y, z
std::optional<Eigen::Quaterniond> OrientationFrom(const json& numbers) {
  if (!numbers.is_array() || numbers.size() != 4) return std::nullopt;
  for (const json& number : numbers) {
    if (!number.is_number()) return std::nullopt;
  }
  return Eigen::Quaterniond(numbers[0].get<double>(), numbers[1].get<double>(),
                            numbers[2].get<double>(), numbers[3].get<double>());
}

/// @param origin  epoch of the oldest journal, to which t_s refers in every row
cell::JournalRow RowFrom(const Rows& rows, int k, const std::vector<model::Joint>& joints,
                         std::int64_t origin) {
  const std::int64_t journal = rows.Integer(k, 0), unix_ms = rows.Integer(k, 2);
  cell::JournalRow row;
  row.id = rows.Integer(k, 1);
  row.unix_ms = unix_ms;
  row.source = cell::SourceNamed(rows.Text(k, 3));
  row.session = rows.Text(k, 4);
  if (!rows.IsNull(k, 5)) {
    row.measured_W = kMetrePerMm * Vec3(rows.Number(k, 5), rows.Number(k, 6), rows.Number(k, 7));
  }
  row.payload_kg = rows.NumberOrNull(k, 8);
  row.temp_C = rows.NumberOrNull(k, 9);
  row.q = JointsFrom(text::JsonOrNull(rows.Text(k, 10)), joints, model::JointQuantity::kPosition);
  if (!rows.IsNull(k, 11)) AddFurtherColumns(text::JsonOrNull(rows.Text(k, 11)), joints, row);
  const double from_epoch_s = 1e-3 * static_cast<double>(unix_ms) - static_cast<double>(journal);
  row.t_s = row.t_s.value_or(from_epoch_s) + static_cast<double>(journal - origin);
  return row;
}

}  // namespace

Result<CellName> FindCell(Connection& connection, const std::string& text) {
  const std::size_t slash = text.find('/');
  const std::string line = text.substr(0, slash);
  const std::string node = slash == std::string::npos ? "" : text.substr(slash + 1);
  const auto found =
      connection.Run("SELECT cell FROM cell WHERE line = $1 AND node = $2", {line, node});
  if (!found) return found.failure();
  if (!found->empty()) return CellName{static_cast<int>(found->Integer(0, 0)), line, node};
  const auto others = connection.Run(
      "SELECT line || '/' || node FROM cell ORDER BY line <> $1, line, node LIMIT 5", {line});
  if (!others) return others.failure();
  std::vector<std::string_view> names;
  for (int k = 0; k < others->size(); ++k) names.push_back(others->Text(k, 0));
  return Error{fmt::format("the database has no cell {}; name it as LINE/NODE{}", text,
                           names.empty()
                               ? std::string(". It has none yet: is plumbline-collect running?")
                               : fmt::format(", for example {}", fmt::join(names, ", ")))};
}

Result<CellFile> ReadCellFile(Connection& connection, const CellName& cell, const std::string& utc,
                              const std::string& fingerprint) {
  const auto found = connection.Run(
      "SELECT utc, fingerprint, model, toml FROM cell_file WHERE cell = $1"
      " AND ($2::timestamptz IS NULL OR utc = $2 AND fingerprint = $3)"
      " ORDER BY utc DESC LIMIT 1",
      {cell.cell, TextOrNull(utc), fingerprint});
  if (!found) return found.failure();
  if (found->empty()) {
    return Error{fmt::format(
        "{} has not published its cell.toml; a current plumbline-fleet does so whenever "
        "it connects",
        cell.Text())};
  }
  CellFile file{std::string(found->Text(0, 0)), std::string(found->Text(0, 1)), std::nullopt,
                std::string(found->Text(0, 3))};
  if (!found->IsNull(0, 2)) file.model = static_cast<int>(found->Integer(0, 2));
  return file;
}

void AddFurtherColumns(const json& more, const std::vector<model::Joint>& joints,
                       cell::JournalRow& row) {
  if (!more.is_object()) return;
  const auto member = [&more](const char* name) {
    const auto found = more.find(name);
    return found == more.end() ? json() : *found;
  };
  const auto text = [&member](const char* name) {
    const json found = member(name);
    return found.is_string() ? found.get<std::string>() : std::string();
  };
  const auto length_m = [&more](const char* name) {
    const auto value_mm = NumberIn(more, name);
    return value_mm ? std::optional(*value_mm * kMetrePerMm) : std::nullopt;
  };
  using enum model::JointQuantity;
  row.t_s = NumberIn(more, "t_s");
  row.qd = JointsFrom(member("qd"), joints, kVelocity);
  row.qdd = JointsFrom(member("qdd"), joints, kAcceleration);
  row.tau = JointsFrom(member("tau"), joints, kTorque);
  if (const auto step_deg = NumberIn(more, "q_step_deg")) row.q_step_rad = *step_deg * kRadPerDeg;
  row.tool_number = WholeIn(more, "tool");
  row.payload_item = WholeIn(more, "payload_item");
  row.orientation_W = OrientationFrom(member("orientation"));
  row.range_m = length_m("range_mm");
  row.artefact = text("artefact");
  row.gauge_m = length_m("gauge_mm");
  row.sigma_m = length_m("sigma_mm");
  row.camera = text("camera");
}

Result<CellRows> ReadCellRows(Connection& connection, const CellName& cell, const std::string& toml,
                              const RowSelection& selection) {
  config::FaultList faults;
  const auto model = config::CellFromText(toml, cell.Text() + " cell.toml", faults);
  if (!model) {
    return Error{fmt::format("the stored cell.toml of {} has faults, first: {}", cell.Text(),
                             faults.All().empty() ? "" : config::FaultText(faults.All().front()))};
  }
  const auto selected = connection.Run(
      kSelectRows, {cell.cell, TextOrNull(selection.since), TextOrNull(selection.until),
                    selection.model, selection.quarantined, selection.last});
  if (!selected) return selected.failure();

  std::int64_t origin = selected->empty() ? 0 : selected->Integer(0, 0);
  for (int k = 0; k < selected->size(); ++k) origin = std::min(origin, selected->Integer(k, 0));
  // A cell whose queue was replaced may publish a row of its journal under a second number.
  std::set<std::pair<std::int64_t, std::int64_t>> known;
  std::vector<cell::JournalRow> rows;
  int other_joints = 0;
  for (int k = selected->size() - 1; k >= 0; --k) {
    if (!known.emplace(selected->Integer(k, 0), selected->Integer(k, 1)).second) continue;
    cell::JournalRow row = RowFrom(*selected, k, model->robot.joints, origin);
    if (row.q.size() == 0) {
      ++other_joints;
    } else {
      rows.push_back(std::move(row));
    }
  }
  cell::ExportedCsv exported = cell::CsvFromJournal(rows, model->robot.joints);
  CellRows data{std::move(exported.text), static_cast<int>(exported.ids.size()),
                static_cast<double>(origin), std::move(exported.notes)};
  if (other_joints > 0) {
    data.notes.push_back(fmt::format("{} probes left out: not {} joints, as the cell has",
                                     other_joints, model->robot.joints.size()));
  }
  if (data.rows > 0) return data;
  return Error{
      fmt::format("{} has no such probes with their joints. Probes in quarantine are left out "
                  "unless asked for, "
                  "and an old plumbline-fleet publishes no joints",
                  cell.Text())};
}

}  // namespace plumbline::plant
