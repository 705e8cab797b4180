// Parser of measured.csv and test_poses.csv to rows in SI units.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/base/config/fault.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/model/measured_point.h"

namespace plumbline::measure {

/// Columns that a table has. Where one is false, the value is absent in every row.
struct RecordedColumns {
  bool session = false;
  bool time = false;
  bool clock_restarted = false;  ///< t_s was in the file, but is not used
  bool qd = false;
  bool qdd = false;
  bool tau = false;
  bool payload = false;
  bool temperature = false;
  bool position = false;
  bool range = false;
  bool orientation = false;
  bool q_step = false;
  bool artefact = false;
  bool gauge = false;
  bool sigma = false;
  bool camera = false;
  bool tool = false;
  bool item = false;
  bool order = true;  ///< the robot made no other moves between two rows of a session

  bool operator==(const RecordedColumns&) const = default;
};

/// One row.
struct MeasuredRow : model::MeasuredPoint {
  int line = 0;  ///< line number in the file; the header is line 1
  std::string session;
  std::vector<double> further;  ///< values of MeasuredTable::further, in the units of the file
};

struct MeasuredTable {
  std::string file;
  RecordedColumns recorded;
  std::vector<std::string> further;  ///< names of columns that are not part of the format
  /// Offset added to the row numbers of events and curves: the rows in earlier tables.
  double rows_before = 0;
  std::vector<MeasuredRow> rows;      ///< in file order
  std::vector<int> unreadable_lines;  ///< of rows that are not in `rows`; each has a warning
  /// Rows that are not used because no robot carries their payload: line and value [kg].
  std::vector<std::pair<int, double>> excessive_payloads;
  /// Rows without a usable measurement, in file order: rows with joint values only, and unreadable
  /// ones whose joint values can be read. They count in the order of moves.
  std::vector<MeasuredRow> unmeasured;
  /// Line numbers where moves are missing from the table, ascending. Just before such a line the
  /// robot made moves that were not recorded, so the last move to the next row is unknown.
  std::vector<int> breaks;
  std::vector<std::string> notes;  ///< repairs of empty cells and lost lines
  /// Largest number of decimals of a joint angle; nullopt if the table was not read from a file, or
  /// an angle has an exponent.
  std::optional<int> q_decimals;
};

/// Purpose for which a table is read.
enum class TableUse {
  kMeasured,  ///< measured points: rows without one become `unmeasured`
  kPoses,     ///< poses only: columns of measured points are ignored
};

/// Parses a table; pure. Columns may be in any order, separated by commas; a byte-order mark and
/// CRLF line ends are accepted. Angles are converted to rad, lengths to m. For empty cells in
/// measured tables see gaps.h.
///
/// @param joints  the cell's joints; their columns are those of joint_columns.h
/// @param faults  receives faults of the header (a joint's column missing, a group incomplete, a
///                column twice, a column of a joint that the cell lacks) and warnings for each
///                unknown column and each row that cannot be read, with line and reason
/// @return        the table; nullopt if the header has a fault, or if the payloads are in grams
std::optional<MeasuredTable> TableFromCsv(std::string_view text, const std::string& file,
                                          const std::vector<model::Joint>& joints,
                                          config::FaultList& faults,
                                          TableUse use = TableUse::kMeasured);

/// Reads and parses a file; a file that cannot be read is a fault.
std::optional<MeasuredTable> ReadTable(const std::string& path,
                                       const std::vector<model::Joint>& joints,
                                       config::FaultList& faults,
                                       TableUse use = TableUse::kMeasured);

// Check of the tool and payload item numbers in a table against what the cell declares.

/// Checks the columns `tool` and `payload_item` against what the cell declares.
/// @return  the first problem with place, value and remedy ("line 7: tool 3 is not declared ...");
///          nullopt if every row names a declared tool and item, or needs none
std::optional<std::string> NumberProblem(const model::CellModel& cell, const MeasuredTable& table);

/// Notes on columns that are recorded but not used, and on items that no row can switch on.
std::vector<std::string> NumberNotes(const model::CellModel& cell, const MeasuredTable& table);

}  // namespace plumbline::measure
