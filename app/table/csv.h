// measured.csv and test_poses.csv -> rows in SI.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
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
};

struct MeasuredTable {
  std::string file;
  RecordedColumns recorded;
  std::vector<std::string> further;   ///< recorded columns that the format does not know
  std::vector<MeasuredRow> rows;      ///< in file order
  std::vector<int> unreadable_lines;  ///< rows that are not in `rows`; each has its warning
  /// Most decimals that a joint's angle is written with; not known of a table that was no file, or
  /// where an exponent is written.
  std::optional<int> q_decimals;
};

/// Reads a table by its text; a pure function. Columns stand in any order, separated by commas;
/// a byte-order mark and CRLF line ends are accepted. Angles become rad, lengths m.
///
/// @param joints  the cell's: joint i has the column q<i>_deg, or q<i>_mm where it is prismatic
/// @param faults  gets faults of the header (a joint's column missing, a group incomplete, a
///                column twice, a column of a joint that the cell lacks) and warnings for each
///                column of another meaning and each row that cannot be read, by line and reason
/// @return        the table; nothing where the header has a fault
std::optional<MeasuredTable> TableFromCsv(std::string_view text, const std::string& file,
                                          const std::vector<Joint>& joints, FaultList& faults);

/// TableFromCsv of a file's content; a file that cannot be read is a fault.
std::optional<MeasuredTable> ReadTable(const std::string& path, const std::vector<Joint>& joints,
                                       FaultList& faults);

}  // namespace plumbline
