// Measured rows made ready for a diagnosis: loads, conditions, clusters, signals, noise.
#pragma once

#include <string>
#include <vector>

#include "app/diagnosis/indices.h"
#include "app/diagnosis/residual_layout.h"
#include "app/table/csv.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/result.h"

namespace plumbline {

/// A recorded signal over the rows.
struct RecordedSignal {
  std::string column;  ///< as the file names it, with its unit
  PerRow<double> values;
  bool of_joint = false;  ///< position, velocity, acceleration or torque of a joint
  double low = 0, high = 0;
  int distinct = 0;  ///< distinct values, counted to 50
};

struct Dataset {
  CellModel cell;
  MeasuredTable table;
  PerRow<Conditions> conditions;
  PerRow<Payload> payloads;
  Indexed<SessionIndex, std::string> sessions;  ///< one empty name where none is recorded
  PerRow<RowNumbers> numbers;
  PerRow<SessionIndex> session_of;
  PerRow<ClusterIndex> cluster_of;  ///< rows of one pose, session and payload
  int clusters = 0;
  Indexed<SignalIndex, RecordedSignal> signals;  ///< those that vary
  std::vector<int> still_joints;                 ///< joints that never moved (0-based)
  bool weight_known = false;                     ///< all link masses are declared
  bool torques_known = false;                    ///< every joint's: by the weight, or measured
  double sigma_m = 0;                            ///< one axis; 0: not known
  std::string sigma_origin;
  double repeat_sigma_m = 0;  ///< from repeats; 0: too few of them
  int repeat_freedom = 0;
  double q_step_rad = 0;        ///< largest step of the joint readings; 0: finer than matters
  double reading_radius_m = 0;  ///< what that costs at the tip, 95 %, middle row
  double reading_sigma_m = 0;   ///< the same, one axis, as it adds to sigma_m
  std::vector<std::string> notes;
  std::vector<std::string> not_recorded;

  int rows() const { return static_cast<int>(table.rows.size()); }
  IndexRange<RowIndex> row_indices() const { return FirstIndices<RowIndex>(rows()); }
  const MeasuredRow& measured(RowIndex row) const { return table.rows[row.offset()]; }
  /// True where the instrument measures ranges, else positions.
  bool ranges() const { return cell.measurement.kind == MeasurementKind::kRange; }
  RowLayout layout() const;
  /// Lengths that a row measures, the mean over the rows: 3 of positions, 1 of ranges.
  double lengths_per_row() const;
  int sessions_count() const { return sessions.count(); }
  bool frames_free() const { return !cell.measurement.frame_known; }
  bool tip_free() const { return !cell.measurement.tool_known; }
};

/// Every row of the data; or `most` of them spread evenly, all where there are not more.
FitRows EveryRow(const Dataset& data);
FitRows EvenlySpread(const Dataset& data, int most);

/// The same with some of its rows only.
Dataset Thinned(const Dataset& data, const FitRows& rows);

/// Checks the rows and makes them ready.
/// @return  an error that says what to do where they cannot be used at all
Result<Dataset> DatasetFrom(const CellModel& cell, MeasuredTable measured);

}  // namespace plumbline
