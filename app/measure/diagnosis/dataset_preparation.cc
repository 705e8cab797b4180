#include "app/measure/diagnosis/dataset_preparation.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/measure/diagnosis/clusters.h"
#include "app/measure/diagnosis/dataset_noise.h"
#include "app/measure/diagnosis/fahrenheit.h"
#include "app/measure/diagnosis/impossible_values.h"
#include "app/measure/diagnosis/missing_signals.h"
#include "app/measure/diagnosis/nuisances.h"
#include "app/measure/diagnosis/payload_unit_changes.h"
#include "app/measure/diagnosis/quaternion_order.h"
#include "app/measure/diagnosis/recorded_signals.h"
#include "app/measure/diagnosis/row_copies.h"
#include "app/measure/table/conditions.h"
#include "app/measure/table/numbered_rows.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

constexpr int kMinRows = 4;

/// Adds a note on rows that name an artefact beside a measured position.
void NoteUnusedArtefacts(Dataset& data, const PerRow<Observation>& observations) {
  int count = 0, first = 0;
  for (const RowIndex row : observations.indices()) {
    const MeasuredRow& of_row = data.table.rows[row.offset()];
    if (of_row.artefact.empty() || OnArtefact(observations[row].kind)) continue;
    if (count++ == 0) first = of_row.line;
  }
  if (count == 0) return;
  data.notes.push_back(
      fmt::format("{} rows name an artefact beside a position (first: line {}): the position is "
                  "used, not the artefact; leave x_mm, y_mm, z_mm empty to use the artefact",
                  count, first));
}

/// Determines what each row measures, and moves rows that measure nothing to `unmeasured`, where
/// they still count as moves.
Result<void> FindObservations(Dataset& data) {
  MeasuredTable& table = data.table;
  Result<PerRow<Observation>> all = ObservationsOf(data.cell, table);
  if (!all) return Error{all.error()};
  NoteUnusedArtefacts(data, *all);
  std::vector<MeasuredRow> measured;
  for (const RowIndex row : all->indices()) {
    const bool used = (*all)[row].kind != ObservationKind::kNone;
    (used ? measured : table.unmeasured).push_back(std::move(table.rows[row.offset()]));
    if (used) data.observations.push_back((*all)[row]);
  }
  table.rows = std::move(measured);
  std::stable_sort(table.unmeasured.begin(), table.unmeasured.end(),
                   [](const MeasuredRow& a, const MeasuredRow& b) { return a.line < b.line; });
  if (table.unmeasured.empty()) return {};
  data.notes.push_back(
      fmt::format("{} rows have joint readings but no usable measurement (first: line {}): they "
                  "are used only to know how the robot moved",
                  table.unmeasured.size(), table.unmeasured.front().line));
  return {};
}

void FindSessions(Dataset& data) {
  std::map<std::string, SessionIndex> known;
  for (const MeasuredRow& row : data.table.rows) {
    const auto [entry, is_new] = known.emplace(row.session, SessionIndex(data.sessions_count()));
    if (is_new) data.sessions.push_back(row.session);
    data.session_of.push_back(entry->second);
  }
}

/// Error if the table has no measurements of any kind that the cell permits.
Result<void> CheckMeasured(const Dataset& data) {
  const bool range = data.ranges();
  const RecordedColumns& recorded = data.table.recorded;
  if (range ? recorded.range : recorded.position) return {};
  if (recorded.artefact && !data.cell.artefacts.empty()) return {};
  if (recorded.artefact) {
    return Error{
        "has a column artefact, but the cell declares none: add an [[artefact]] for each name"};
  }
  return Error{
      fmt::format("has no {} column{}: nothing was measured; check [measurement] kind in the cell, "
                  "and the header of the file",
                  range ? "range_mm" : "x_mm, y_mm, z_mm", range ? "" : "s")};
}

Result<void> CheckRowCount(const Dataset& data) {
  const Nuisances nuisances(data);
  const int free_numbers = nuisances.size() - nuisances.equations();
  int residuals = 0;
  for (const Observation& of : data.observations) residuals += ResidualsOf(of.kind);
  const int of_row = data.rows() > 0 ? std::max(1, residuals / data.rows()) : 1;
  const int needed = std::max(kMinRows, (free_numbers + 3 + of_row - 1) / of_row);
  if (data.rows() >= needed) return {};
  return Error{fmt::format(
      "has {} usable rows; at least {} are needed{}: measure more poses, "
      "spread over the cell (30 or more distinguish the effects)",
      data.rows(), needed,
      free_numbers > 0 ? !data.cell.artefacts.empty() ? " to find the unknown frames and places"
                                                      : " to find the unknown frames"
                       : "")};
}

/// Finds the artefacts that rows use, and the sessions with measured orientations.
void FindUsed(Dataset& data) {
  data.used_artefacts.assign(data.cell.artefacts.size(), false);
  data.turned_sessions.assign(data.sessions.size(), false);
  for (const RowIndex row : data.row_indices()) {
    const Observation& of = data.observations[row];
    if (OnArtefact(of.kind)) data.used_artefacts[of.artefact] = true;
    if (of.kind == ObservationKind::kPose) data.turned_sessions[data.session_of[row]] = true;
  }
}

/// Sets the conditions, loads and clusters of the rows.
void SetConditions(Dataset& data) {
  const model::CellModel& cell = data.cell;
  for (const Observation& of : data.observations) {
    data.numbers.push_back({ResidualsOf(of.kind), {}});
  }
  data.conditions = PerRow<effects::Conditions>(ConditionsOf(cell, data.table));
  for (const MeasuredRow& row : data.table.rows) {
    data.payloads.push_back(loads::LoadOf(cell, row.payload_kg, row.tool_number, row.payload_item));
  }
  data.weight_known = loads::GravityLoads(cell).known(0);
  data.torques_known = data.weight_known || data.table.recorded.tau;
  const Clusters clusters = ClustersOf(data.table.rows, data.session_of);
  data.cluster_of = clusters.of_row;
  data.clusters = clusters.count;
}

}  // namespace

Result<Dataset> DatasetFrom(const model::CellModel& cell, MeasuredTable measured) {
  Dataset data;
  data.cell = cell;
  data.table = std::move(measured);
  if (const Result<void> any = CheckMeasured(data); !any) return any.failure();
  if (const Result<void> found = FindObservations(data); !found) return found.failure();
  if (const auto problem = NumberProblem(cell, data.table)) return Error{*problem};
  DropCopies(data);
  if (const auto impossible = ImpossibleValues(data.table, cell.robot.joints)) {
    return Error{*impossible};
  }
  if (const auto grams = PayloadsInGrams(data.table)) return Error{*grams};
  DiscardRestartedClock(data.table);
  NoteLikelyFahrenheit(data.table);
  for (std::string& note : NumberNotes(cell, data.table)) {
    data.notes.push_back(std::move(note));
  }
  data.notes.insert(data.notes.end(), data.table.notes.begin(), data.table.notes.end());
  FindSessions(data);
  FindUsed(data);
  if (const Result<void> enough = CheckRowCount(data); !enough) return enough.failure();
  SetConditions(data);
  if (const auto order = QuaternionsInOtherOrder(data)) return Error{*order};
  FindSignals(data);
  FindStillJoints(data);
  SetNoise(data);
  NoteMissingSignals(data);
  return data;
}

}  // namespace plumbline::measure
