// Data set of a diagnosis: measured rows with loads, conditions, clusters, signals and noise.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/data/indices.h"
#include "app/measure/diagnosis/data/observations.h"
#include "app/measure/table/csv.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

/// A recorded signal over the rows.
struct RecordedSignal {
  std::string column;  ///< column name with its unit
  PerRow<double> values;
  bool of_joint = false;  ///< position, velocity, acceleration or torque of a joint
  double low = 0, high = 0;
  int distinct = 0;  ///< number of distinct values, at most 50
};

struct Dataset {
  model::CellModel cell;
  MeasuredTable table;
  PerRow<effects::Conditions> conditions;
  PerRow<loads::Payload> payloads;
  Indexed<SessionIndex, std::string> sessions;  ///< one empty name if none is recorded
  PerRow<Observation> observations;
  PerRow<RowNumbers> numbers;
  Indexed<ArtefactIndex, bool> used_artefacts;  ///< by at least one row
  Indexed<SessionIndex, bool> turned_sessions;  ///< orientations were measured
  /// Whether a session has measurements with each tool of the cell (CellModel::ToolAt).
  Indexed<SessionIndex, std::vector<bool>> measured_tools;
  PerRow<SessionIndex> session_of;
  PerRow<ClusterIndex> cluster_of;  ///< replicates: same pose, session and payload
  int clusters = 0;
  Indexed<SignalIndex, RecordedSignal> signals;  ///< signals that vary
  std::vector<int> still_joints;                 ///< joints that never moved (0-based)
  bool weight_known = false;                     ///< all link masses are declared
  bool torques_known = false;                    ///< of every joint: computed or measured
  double sigma_m = 0;                            ///< one axis; 0: unknown
  std::string sigma_origin;
  /// Median noise that the rows state, one axis, if any row has its own; replaces the declared one.
  std::optional<double> row_sigma_m;
  double repeat_sigma_m = 0;  ///< from replicates; 0: too few of them
  int repeat_freedom = 0;
  double q_step_rad = 0;        ///< largest step of the joint readings; 0: negligible
  double reading_radius_m = 0;  ///< resulting error at the tip, 95 %, median row
  double reading_sigma_m = 0;   ///< the same as a standard deviation on one axis, part of sigma_m
  std::vector<std::string> notes;
  std::vector<std::string> not_recorded;

  int rows() const { return static_cast<int>(table.rows.size()); }
  IndexRange<RowIndex> row_indices() const { return FirstIndices<RowIndex>(rows()); }
  const MeasuredRow& measured(RowIndex row) const { return table.rows[row.offset()]; }
  /// True if the mass carried in each row is recorded: payload_kg, or the number of an item.
  bool loads_recorded() const {
    return table.recorded.payload || (table.recorded.item && !cell.payload_items.empty());
  }
  /// True if the weight of what the rows carry is modelled.
  bool loads_modelled() const {
    return (table.recorded.payload && cell.payload_cog_F) ||
           (table.recorded.item && !cell.payload_items.empty());
  }
  /// True if the instrument measures ranges; otherwise it measures positions.
  bool ranges() const { return cell.measurement.kind == model::MeasurementKind::kRange; }
  /// True if any row reads a range, from the instrument's anchor or from an artefact.
  bool reads_ranges() const;
  /// True if any row was measured in an instrument's frame, not only on artefacts.
  bool instrument_used() const;
  RowLayout layout() const;
  /// Mean number of lengths per row: 3 for positions, 1 for ranges.
  double lengths_per_row() const;
  /// Mean square noise of a measuring row over its lengths, divided by sigma_m^2: lengths_per_row()
  /// unless rows state a sigma of their own.
  double noise_per_row() const;
  int sessions_count() const { return sessions.count(); }
  /// True for a position measured by a named camera if the cell declares the reference tags: the
  /// error of their positions is then one unknown that all these rows share.
  bool rests_on_tags(RowIndex row) const {
    return !cell.measurement.reference_tags_W.empty() && !measured(row).camera.empty() &&
           observations[row].kind == ObservationKind::kPosition;
  }
  bool frames_free() const { return !cell.measurement.frame_known; }
  bool tip_free() const { return !cell.measurement.tool_known; }
};

/// Every row of the data; or at most `most` of them, evenly spread.
FitRows EveryRow(const Dataset& data);
FitRows EvenlySpacedRows(const Dataset& data, int most);

/// A copy with a subset of the rows; clusters are renumbered.
Dataset SelectRows(const Dataset& data, const FitRows& rows);

/// A [[distance]] between artefacts, or what is declared of one artefact: position, direction and
/// radius. Exactly one of the two is set.
struct Reference {
  std::optional<int> distance;  ///< position in `distances` of the cell
  std::optional<ArtefactIndex> artefact;

  auto operator<=>(const Reference&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// The references between and of artefacts that the rows use.
std::vector<Reference> ReferencesOf(const Dataset& data);

/// "the distance between a and b", "the declared values of a".
std::string NameOf(const Reference& reference, const model::CellModel& cell);

/// The cell with this reference unknown.
model::CellModel Without(const Reference& reference, model::CellModel cell);

}  // namespace plumbline::measure
