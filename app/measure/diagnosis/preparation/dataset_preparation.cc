#include "app/measure/diagnosis/preparation/dataset_preparation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/hypotheses/unit_segment.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/preparation/dataset_noise.h"
#include "app/measure/table/conditions.h"
#include "app/measure/table/csv.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

// Detection of quaternions whose numbers are in another order than the header states.

using Quaternion = Eigen::Quaterniond;

constexpr double kWrong_rad = 5 * kRadPerDeg;
constexpr double kRight_rad = 1 * kRadPerDeg;
constexpr double kLargestTurn_rad = 150 * kRadPerDeg;
constexpr std::size_t kMinTurns = 6;

Quaternion AsWritten(const Quaternion& read) {
  return read;
}

Quaternion Inverse(const Quaternion& read) {
  return read.conjugate();
}

/// Rotation vectors from each row to the next, in the rotated frame; shape (3, rows - 1).
Eigen::Matrix3Xd Turns(const std::vector<Quaternion>& orientations,
                       Quaternion (*undo)(const Quaternion&)) {
  Eigen::Matrix3Xd turns(3, static_cast<Eigen::Index>(orientations.size()) - 1);
  for (std::size_t k = 1; k < orientations.size(); ++k) {
    const Quaternion turn = undo(orientations[k - 1]).conjugate() * undo(orientations[k]);
    turns.col(static_cast<Eigen::Index>(k) - 1) = VectorFromRotation(turn.toRotationMatrix());
  }
  return turns;
}

/// Median difference between the measured turns and the predicted ones [rad], after the constant
/// rotation between the two tool frames, by least squares.
double MedianDifference(const std::vector<Quaternion>& measured,
                        const std::vector<Quaternion>& predicted,
                        const std::vector<SessionIndex>& sessions,
                        Quaternion (*undo)(const Quaternion&)) {
  const Eigen::Matrix3Xd of_measured = Turns(measured, undo);
  const Eigen::Matrix3Xd of_predicted = Turns(predicted, AsWritten);
  std::vector<Eigen::Index> clear;  // turns near 180 deg may have either sign
  for (Eigen::Index k = 0; k < of_predicted.cols(); ++k) {
    const auto row = static_cast<std::size_t>(k);
    const bool same_session = sessions[row] == sessions[row + 1];
    if (same_session && of_predicted.col(k).norm() < kLargestTurn_rad) clear.push_back(k);
  }
  if (clear.size() < kMinTurns) return HUGE_VAL;
  const Eigen::Matrix3Xd from = of_predicted(Eigen::all, clear);
  const Eigen::Matrix3Xd to = of_measured(Eigen::all, clear);
  const Mat3 R = NearestRotation(to * from.transpose());
  std::vector<double> differences;
  for (Eigen::Index k = 0; k < from.cols(); ++k) {
    differences.push_back((to.col(k) - R * from.col(k)).norm());
  }
  return statistics::MedianOf(differences);
}

/// Finds quaternions whose columns are in the order x, y, z, w, or that are inverse (the
/// measurement frame in the TCP frame). The rotation from one row to the next, in the tool frame,
///   q_k^-1 q_(k+1)
/// does not depend on the instrument's frame, and on the tool only by one constant rotation, which
/// is fitted; it is compared with the rotation of the predicted tip. Both mistakes look alike:
/// (w, x, y, z) -> (x, y, z, w) and the inverse are orthogonal maps of the four numbers with
/// determinant -1, and the product of two such maps is q -> a q b with constant rotations a, b.
/// @return  a sentence with the remedy if the median difference is above 5 deg as written and below
///          1 deg with the inverse; nullopt if not, if no row is a pose, or with fewer than 6 clear
///          rotations
std::optional<std::string> QuaternionsInOtherOrder(const Dataset& data) {
  const deflection::LoadedArm arm(data.cell);
  std::vector<Quaternion> measured, predicted;
  std::vector<SessionIndex> sessions;
  for (const RowIndex row : data.row_indices()) {
    if (data.observations[row].kind != ObservationKind::kPose) continue;
    sessions.push_back(data.session_of[row]);
    deflection::LoadedState state;
    arm.AtActual(data.measured(row).q, data.payloads[row], data.conditions[row], state);
    measured.push_back(*data.measured(row).orientation_W);
    predicted.emplace_back(state.X_WT.R);
  }
  if (measured.size() <= kMinTurns) return std::nullopt;
  const double before = MedianDifference(measured, predicted, sessions, AsWritten);
  if (before < kWrong_rad || !std::isfinite(before)) return std::nullopt;
  const double after = MedianDifference(measured, predicted, sessions, Inverse);
  if (after > kRight_rad) return std::nullopt;
  return fmt::format(
      "the rotations between successive rows differ by {:.0f} deg (median) from those of the "
      "joints, "
      "but only by {:.2g} deg if the quaternions are in the order x, y, z, w or inverted. If the "
      "order is x, y, z, w, write the header as qx, qy, qz, qw; if they are inverted, negate qx, "
      "qy, qz",
      before / kRadPerDeg, after / kRadPerDeg);
}

// Notes on what the rows and the cell do not state, and what cannot be identified without it.

void FindMissingColumns(Dataset& data) {
  const RecordedColumns& recorded = data.table.recorded;
  const auto missing = [&data](bool there, const char* what) {
    if (!there) data.not_recorded.emplace_back(what);
  };
  missing(recorded.time || recorded.clock_restarted, "t_s: drift and warm-up cannot be identified");
  missing(!recorded.clock_restarted,
          "t_s without a restart of its clock: drift and warm-up cannot be identified");
  missing(recorded.temperature, "temp_C: thermal growth cannot be identified");
  missing(data.loads_recorded(),
          "payload_kg: effects of the load can be identified only from the arm's own weight");
  missing(recorded.qd, "qd1_deg_s..: latency and viscous lag cannot be identified");
  missing(recorded.order,
          "the robot's moves between the probes: backlash by move and approach lag cannot be "
          "identified");
  missing(recorded.qdd, "qdd1_deg_s2..: inertia cannot be identified");
}

/// A warm-up follows exp(-t / time constant) from t_s = 0 on. With another time zero, it would need
/// a shifted base and sizes e^(first / time constant) times as large.
void CheckTimeZero(Dataset& data) {
  if (!data.table.recorded.time) return;
  double first_s = 1e300, last_s = -1e300;
  for (const MeasuredRow& row : data.table.rows) {
    first_s = std::min(first_s, *row.t_s);
    last_s = std::max(last_s, *row.t_s);
  }
  if (std::abs(first_s) > last_s - first_s) {
    data.not_recorded.push_back(fmt::format(
        "t_s starts at {:.4g} s and spans {:.4g} s: thermal drift is modelled from t_s = 0, so a "
        "warm-up that started with these rows cannot be identified; count t_s from its start",
        first_s, last_s - first_s));
  }
}

/// Fills `not_recorded`, and adds notes. Everything else of the data set must be set.
void NoteMissingSignals(Dataset& data) {
  FindMissingColumns(data);
  CheckTimeZero(data);
  if (data.table.recorded.payload && !data.cell.payload_cog_F) {
    data.notes.emplace_back(
        "payload_kg is recorded, but the cell has no [payload] cog_mm: the column is used only as "
        "a signal, and the weight of the payload is not modelled");
  }
  const bool tags = !data.cell.measurement.reference_tags_W.empty();
  const auto& rows = data.table.rows;
  if (tags &&
      std::ranges::none_of(rows, [](const MeasuredRow& row) { return !row.camera.empty(); })) {
    data.notes.push_back(fmt::format(
        "[measurement] reference_tags_mm has no effect, because no {}, or the errors of the tags "
        "are not included in the stated uncertainties",
        data.table.recorded.camera
            ? "usable row names a camera: write side, rear, front or top into the column camera"
            : "row names a camera: add a column camera"));
  }
  if (!data.torques_known) {
    data.notes.emplace_back(
        "a link has no link_mass_kg, so the joint torques are unknown: compliance is fitted as "
        "gravity_sag, the products of compliance and weight that the poses identify; other effects "
        "of the load on joints cannot be identified");
  }
  if (!data.table.unreadable_lines.empty()) {
    data.notes.push_back(fmt::format("{} rows could not be read and were ignored (first: line {})",
                                     data.table.unreadable_lines.size(),
                                     data.table.unreadable_lines.front()));
  }
  if (data.cell.measurement.kind == model::MeasurementKind::kPose &&
      !data.cell.measurement.sigma_rad) {
    data.notes.emplace_back(
        "only the positions of the measured poses are used, not the orientations: declare their "
        "uncertainty as sigma_deg of [measurement] to use them");
  }
}

// Detection of rows that are exact copies of earlier ones.

/// Erases the marked rows and their observations.
void EraseRows(Dataset& data, const std::vector<bool>& erased) {
  std::vector<MeasuredRow> rows;
  PerRow<Observation> observations;
  for (const RowIndex row : data.row_indices()) {
    if (erased[row.offset()]) continue;
    rows.push_back(std::move(data.table.rows[row.offset()]));
    observations.push_back(data.observations[row]);
  }
  data.table.rows = std::move(rows);
  data.observations = std::move(observations);
}

/// Every number of a row.
std::vector<double> NumbersOf(const MeasuredRow& row) {
  constexpr double kAbsent = HUGE_VAL;  // no cell holds it
  std::vector<double> numbers;
  for (const std::optional<double>& value : {row.t_s, row.payload_kg, row.temp_C, row.range_m,
                                             row.q_step_rad, row.gauge_m, row.sigma_m}) {
    numbers.push_back(value.value_or(kAbsent));
  }
  for (const std::optional<int>& number : {row.tool_number, row.payload_item})
    numbers.push_back(number ? *number : kAbsent);
  const Vec3 p = row.measured_W.value_or(Vec3::Constant(kAbsent));
  numbers.insert(numbers.end(), p.begin(), p.end());
  const Eigen::Vector4d turn =
      row.orientation_W ? row.orientation_W->coeffs() : Eigen::Vector4d::Constant(kAbsent);
  numbers.insert(numbers.end(), turn.begin(), turn.end());
  for (const model::JointVector* of_joints : {&row.q, &row.qd, &row.qdd, &row.tau}) {
    numbers.insert(numbers.end(), of_joints->begin(), of_joints->end());
  }
  numbers.insert(numbers.end(), row.further.begin(), row.further.end());
  return numbers;
}

/// Removes copies: rows equal to an earlier one in every digit of every column including t_s.
/// Without t_s, equal rows may also be repeated measurements with a coarse resolution; they are
/// kept, with a note.
/// The table and what each row measures must be set.
void DropCopies(Dataset& data) {
  std::set<std::tuple<std::string, std::string, std::vector<double>>> seen;
  const bool timed = data.table.recorded.time;
  int copies = 0, first = 0;
  std::vector<bool> copy;
  for (const MeasuredRow& row : data.table.rows) {
    copy.push_back(!seen.emplace(row.session, row.artefact, NumbersOf(row)).second);
    if (copy.back() && copies++ == 0) first = row.line;
  }
  if (copies == 0) return;
  if (timed) EraseRows(data, copy);
  data.notes.push_back(
      timed ? fmt::format(
                  "{} rows are exact copies of earlier rows and were ignored (first: line {})",
                  copies, first)
            : fmt::format(
                  "{} rows are equal to earlier rows in every digit (first: line {}); without t_s "
                  "they cannot be distinguished from repeated measurements and were kept",
                  copies, first));
}

// Signals that vary over the rows of a data set, and joints that do not.

constexpr double kStandstill = 1e-4;  // [rad] or [m]; a smaller movement counts as none

void AddSignal(Dataset& data, std::string column, PerRow<double> values, bool of_joint) {
  RecordedSignal signal{std::move(column), std::move(values), of_joint};
  signal.low = *std::ranges::min_element(signal.values);
  signal.high = *std::ranges::max_element(signal.values);
  const double span = signal.high - signal.low;
  if (!(span > 1e-9 * (1 + std::abs(signal.high)))) return;
  std::set<long> distinct;
  for (const double value : signal.values) {
    if (distinct.size() < 50) distinct.insert(std::lround(1e4 * (value - signal.low) / span));
  }
  signal.distinct = static_cast<int>(distinct.size());
  data.signals.push_back(std::move(signal));
}

/// Finds the signals that effects may depend on: time, row number, temperature, payload, further
/// columns and the joints' quantities. Call it after the conditions of the rows are set.
void FindSignals(Dataset& data) {
  const auto add = [&data](const std::string& column, bool of_joint = false) {
    PerRow<double> values;
    for (const effects::Conditions& moment : data.conditions) {
      const std::optional<double> value = moment.Signal(column);
      if (!value) return;
      values.push_back(*value);
    }
    AddSignal(data, column, std::move(values), of_joint);
  };
  add("t_s");
  if (!data.table.recorded.time) add("row");
  add("temp_C");
  if (data.loads_recorded()) add("payload_kg");
  for (const std::string& column : data.table.further) add(column);
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const model::JointType type = data.cell.robot.joints[i].type;
    using Quantity = model::JointQuantity;
    for (const Quantity quantity :
         {Quantity::kPosition, Quantity::kVelocity, Quantity::kAcceleration, Quantity::kTorque}) {
      add(model::JointColumnName(quantity, type, i), true);
    }
  }
}

/// Finds the joints that never moved, with a note for each.
void FindStillJoints(Dataset& data) {
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const auto moved = [&](const MeasuredRow& row) {
      return std::abs(row.q[i] - data.table.rows.front().q[i]) > kStandstill;
    };
    if (std::ranges::any_of(data.table.rows, moved)) continue;
    data.still_joints.push_back(i);
    data.notes.push_back(fmt::format(
        "joint q{} never moved: effects that depend on it cannot be identified", i + 1));
  }
}

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
  std::ranges::stable_sort(
      table.unmeasured, [](const MeasuredRow& a, const MeasuredRow& b) { return a.line < b.line; });
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
  for (const Observation& observation : data.observations)
    residuals += ResidualsOf(observation.kind);
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

/// Finds the artefacts that rows use, the sessions with measured orientations, and their tools.
void FindUsed(Dataset& data) {
  data.used_artefacts.assign(data.cell.artefacts.size(), false);
  data.turned_sessions.assign(data.sessions.size(), false);
  data.measured_tools.assign(data.sessions.size(),
                             std::vector<bool>(static_cast<std::size_t>(data.cell.tools())));
  for (const RowIndex row : data.row_indices()) {
    const Observation& observation = data.observations[row];
    if (OnArtefact(observation.kind)) data.used_artefacts[observation.artefact] = true;
    if (observation.kind == ObservationKind::kPose)
      data.turned_sessions[data.session_of[row]] = true;
    if (ResidualsOf(observation.kind) == 0) continue;
    const int tool = loads::ToolIndexOf(data.cell, data.measured(row).tool_number).value_or(0);
    data.measured_tools[data.session_of[row]][tool] = true;
  }
}

/// Sets the conditions, loads and clusters of the rows.
void SetConditions(Dataset& data) {
  const model::CellModel& cell = data.cell;
  for (const Observation& observation : data.observations) {
    data.numbers.push_back({ResidualsOf(observation.kind), {}});
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
