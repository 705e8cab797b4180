// Questions across cells: which are worst, which drift, what differs since a date, what awaits a
// person. Computed from the daily sums of the database.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/plant/answers/robust_statistics.h"
#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// Days are counted since 1970 in UTC.
struct ReportPeriod {
  int first_day = 0, last_day = 0;
  /// With --since: the period begins at that date, and is compared with that many days before it.
  int compared_days = 0;

  /// Days that are taken together, so that a long period has about kMostValues values: their pairs
  /// take time by the square.
  int bin_days() const {
    return 1 + (std::max(last_day - first_day + 1, compared_days) - 1) / kMostValues;
  }
  static constexpr int kMostValues = 90;
};

/// Sums of one cell, day and model, of the table cell_day.
struct DaySums {
  int day = 0, model = 0;
  std::int64_t probes = 0, wild = 0;
  double sum_mm = 0, max_mm = 0;
  double sum_dx_mm = 0, sum_dy_mm = 0, sum_dz_mm = 0;
};

/// A day (or bin of days) of fewer probes has no mean that is worth comparing.
inline constexpr int kMinDayProbes = 5;

struct ReportedCell {
  std::string line, node, name, arm_model, arm_series;
  std::optional<double> age_years;  ///< since it was installed
  int model = 0, proposed_model = 0;
  std::vector<DaySums> days;  ///< in order
};

struct StaleLens {
  std::string line, node, name, camera, reason;
  double since_utc = 0;
};
struct DiagnosisAnswer {
  std::string line, node, name, summary;
  double utc = 0;
};

struct ReportData {
  ReportPeriod period;
  std::vector<ReportedCell> cells;
  std::vector<StaleLens> lenses;
  std::vector<DiagnosisAnswer> diagnoses;  ///< the newest of each cell
};

/// @param since  day of --since; nullopt: the last `days` days
Result<ReportData> ReadReportData(Connection& connection, int days, std::optional<int> since);

// Answers. All lengths are mm, all intervals 95 % unless they say otherwise.

/// Level of a cell's residual: the median over days of the mean size of its residuals.
struct CellLevel {
  const ReportedCell* cell;
  Interval level_mm;
  double autocorrelation = 0;  ///< of neighbouring days, as the tests assume it
  double max_mm = 0;
  std::int64_t probes = 0, wild = 0;
};

/// The smallest p of four series (size and the three components), times four, and Holm's adjustment
/// over all cells tested.
struct CellDrift {
  const ReportedCell* cell = nullptr;
  Trend size_mm;        ///< of the mean size, per day
  double moves_mm = 0;  ///< slope of the mean residual vector, per day
  double p_adjusted = 1;
};
struct CellShift {
  const ReportedCell* cell;
  Shift size_mm;
  double p_adjusted = 1;
  bool other_model = false;  ///< the model in force is not the one before
};

/// Cells of one arm model, series or age: the median of their slopes or shifts.
struct GroupAnswer {
  std::string kind, name;
  int cells = 0;
  std::optional<GroupMedian> median_mm;  ///< per day, or the difference
  double p_adjusted = 1;
};

struct Maintenance {
  const ReportedCell* cell;
  Interval reduction_mm;  ///< of the mean residual, if what it is based on is restored
  std::string basis;
};

struct PlantReport {
  std::vector<CellLevel> levels;  ///< worst first
  std::vector<CellDrift> drifts;  ///< of all cells tested, by adjusted p
  int too_few_days = 0;           ///< cells that could not be tested
  int never_significant = 0;      ///< tested cells whose days cannot reach the adjusted p
  /// Slope of the size per day from which half of the other cells would be listed every second
  /// time; nullopt without such cells.
  std::optional<double> detectable_mm;
  std::vector<GroupAnswer> drift_groups;
  std::vector<CellShift> shifts;  ///< with --since, by adjusted p
  int too_few_shift_days = 0;
  std::vector<GroupAnswer> shift_groups;
  std::vector<Maintenance> maintenance;  ///< by the lower bound of the reduction
};

/// Significance after adjustment.
inline constexpr double kSignificance = 0.05;

/// Pure. The result points into `data`.
PlantReport ReportOf(const ReportData& data);

}  // namespace plumbline::plant
