// measured.csv and test_poses.csv -> rows in SI.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// Which columns a table has. What is false was not recorded: its values in the rows mean nothing.
struct RecordedColumns {
  bool session = false;
  bool time = false;
  bool qd = false;
  bool qdd = false;
  bool tau = false;
  bool payload = false;
  bool temperature = false;
  bool position = false;
  bool range = false;
  bool orientation = false;
  bool q_step = false;
  bool order = true;  ///< between two rows of a session the robot made no other move

  bool operator==(const RecordedColumns&) const = default;
};

/// One row in SI; joint values as the controller counts them.
struct MeasuredRow {
  int line = 0;  ///< of the file, the header being line 1
  std::string session;
  double t_s = 0;
  JointVector q;          ///< [rad] or [m]
  JointVector qd;         ///< [rad/s] or [m/s]
  JointVector qdd;        ///< [rad/s^2] or [m/s^2]
  JointVector tau;        ///< [N m] or [N]
  double q_step_rad = 0;  ///< of the registers that q was read from; 0: finer than matters
  double payload_kg = 0;
  double temp_C = 0;
  Vec3 p_WT = Vec3::Zero();  ///< measured tip [m]
  double range_m = 0;
  Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();  ///< measured orientation, unit length
  std::vector<double> further;  ///< of MeasuredTable::further, as the file has them
  bool has_point = true;        ///< false: its x_mm, y_mm, z_mm are empty, `p_WT` means nothing
  bool has_range = true;        ///< likewise range_mm
  bool has_orientation = true;  ///< likewise qw, qx, qy, qz
};

struct MeasuredTable {
  std::string file;
  RecordedColumns recorded;
  std::vector<std::string> further;  ///< recorded columns that the format does not know
  /// Rows before the first of these, in the order that `row` of an event or a curve counts.
  double rows_before = 0;
  std::vector<MeasuredRow> rows;      ///< in file order
  std::vector<int> unreadable_lines;  ///< rows that are not in `rows`; each has its warning
  /// Of rows that are not used because no robot carries their payload: line and number [kg].
  std::vector<std::pair<int, double>> excessive_payloads;
  /// Where the robot was without a usable measurement, in file order: rows of joints alone, and
  /// unreadable ones whose joints can be read. They keep their place in the order of moves.
  std::vector<MeasuredRow> unmeasured;
  /// Lines before which the robot made moves that are not in the table, ascending: the last move of
  /// the first row at or after such a line is not known.
  std::vector<int> breaks;
  std::vector<std::string> notes;  ///< what was done about empty cells and lost lines
  /// Most decimals that a joint's angle is written with; not known of a table that was no file, or
  /// where an exponent is written.
  std::optional<int> q_decimals;
};

/// What a table is read for.
enum class TableUse {
  kMeasured,  ///< measured points: a row without one is `unmeasured`
  kPoses,     ///< poses only: columns of measured points are not read
};

/// Reads a table by its text; a pure function. Columns stand in any order, separated by commas;
/// a byte-order mark and CRLF line ends are accepted. Angles become rad, lengths m. Of measured
/// tables an empty cell costs that cell: see gaps.h.
///
/// @param joints  the cell's; their columns are those of joint_columns.h
/// @param faults  gets faults of the header (a joint's column missing, a group incomplete, a
///                column twice, a column of a joint that the cell lacks) and warnings for each
///                column of another meaning and each row that cannot be read, by line and reason
/// @return        the table; nothing where the header has a fault
std::optional<MeasuredTable> TableFromCsv(std::string_view text, const std::string& file,
                                          const std::vector<Joint>& joints, FaultList& faults,
                                          TableUse use = TableUse::kMeasured);

/// TableFromCsv of a file's content; a file that cannot be read is a fault.
std::optional<MeasuredTable> ReadTable(const std::string& path, const std::vector<Joint>& joints,
                                       FaultList& faults, TableUse use = TableUse::kMeasured);

}  // namespace plumbline
