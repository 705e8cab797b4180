// Rows of measured.csv from files of instruments and robots.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/measure/imports/mapping.h"

namespace plumbline::measure {

// Parser of the time stamps in exports of instruments and robots.

/// Order of day and month in dates with slashes.
enum class DateOrder { kMonthFirst, kDayFirst };

/// Seconds since 1970, for differences only (no time zone): "08.11.2022 16:17:28.353",
/// "2022-11-08T16:17:28", "11/08/2022 04:17:28 PM" (`slash_order`), each with or without a leading
/// apostrophe. nullopt if it is no such stamp.
std::optional<double> SecondsOfTimeStamp(std::string_view text,
                                         DateOrder slash_order = DateOrder::kMonthFirst);

/// A number of seconds, milliseconds, microseconds or nanoseconds since 1970, for years from 1973
/// to 2286.
struct EpochTime {
  double seconds = 0;
  std::string_view unit{};  ///< "seconds", "milliseconds", ..
};
/// Seconds of these years lie between 1e8 and 1e10, a factor of 100, and each unit is a thousandth
/// of the one before: the size of the number determines the unit. nullopt for any other number.
std::optional<EpochTime> EpochTimeOf(double number);

/// True if the text is a time stamp whose date has slashes, in either order.
bool HasSlashDate(std::string_view text);

/// Largest permissible error of an instrument, constant + per_metre * distance [mm, mm/m].
struct PermissibleError {
  double constant_mm = 0;
  double per_metre_mm = 0;
};

/// Statements of the user in addition to the file.
struct ImportOptions {
  std::string length_unit, angle_unit, temperature_unit;  ///< of columns that state none
  std::string artefact;                                   ///< of every row with a gauge or a range
  std::optional<PermissibleError> permissible_error;
  std::optional<char> decimal;  ///< ',' or '.', if the file leaves it open; a mapping outranks it
};

/// Expected content of a file; decides the meaning of columns without names.
enum class FileRole { kMeasured, kJoints };

/// A file as it was understood, before its rows are read.
struct UnderstoodFile {
  std::string file;
  std::string encoding;
  text::DelimitedText layout;
  std::vector<ColumnMeaning> meanings;
  /// Columns of which a value that both decimal signs allow, such as "81,410", is rejected.
  std::set<std::size_t> unclear_decimals{};
  /// False if a column has no known unit or another decimal sign than the file: the reasons for
  /// rejecting its rows are then misleading.
  bool readable = true;
};

/// A line that gives no measurement, and why.
struct RejectedLine {
  int line = 0;
  std::string reason;
  std::string file;  ///< that has the line
};

/// One row: numbers in the units of measured.csv and texts, by column.
struct ImportedRow {
  int line = 0;
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> texts;
  std::string file;  ///< that has the line

  bool HasJoints() const { return numbers.contains("q1_deg") || numbers.contains("q1_mm"); }
  /// True if the row holds a position, a range, a gauge reading, an orientation, or the touch of an
  /// artefact.
  bool HasMeasurement() const;
};

struct ImportedTable {
  std::vector<ImportedRow> rows;       ///< in the order of the file, the rejected ones included
  std::vector<RejectedLine> rejected;  ///< whose measurement is left out
  std::vector<std::string> notes;      ///< what was assumed or derived
  /// The time stamp from which t_s counts [s since 1970]; nullopt if t_s has no known origin.
  std::optional<double> first_stamp_s;
};

/// Decodes a file and finds its layout and the meaning of its columns. Pure.
/// Without column names, one column holds readings of a gauge; they are in mm if each has a sign or
/// is a run of X or F, the layout of a Keyence LK-G, unless the options state a unit. Three are x,
/// y, z, and those of a file of joints are the joints in order, after the number or name of the row
/// if the first column counts 1, 2, 3 .., or has different names, or different integers from 0 on
/// beside columns that all have the same number of decimals.
/// @param faults  receives faults of the mapping, one for the columns of each kind whose unit
///                neither the file nor the options nor the mapping state, one for each column that
///                has the meaning of an earlier one and other values, and those of decimal_signs.h
UnderstoodFile Understand(std::string_view bytes, const std::string& file, FileRole role,
                          const Mapping& mapping, const std::string& mapping_file,
                          const ImportOptions& options, config::FaultList& faults);

/// Reads the rows. A row with a fault keeps its joints, since the robot was there, but loses its
/// measurement: an unreadable or incomplete value, a row marked as deleted, a quaternion that is
/// not of unit length, a gauge without a value (runs of X or F). A line with too many fields loses
/// its joints too, since its columns are shifted. An unreadable t_s, temp_C, sigma_mm or U(95) is
/// left out alone. Dates with slashes have one order of day and month in the column, that of the
/// dates which allow only one, else month first.
/// Standard deviations come from U(95): per axis U / 2 (k = 2), the root mean square of the axes;
/// of a 3-D radius U / 2.795 (95 % of a chi distribution with 3 degrees of freedom). A permissible
/// error is added to it, or to the file's sigma_mm, as a rectangular distribution, MPE / sqrt(3);
/// it refers to the distance of a position, to a range, or to a gauge's reading.
ImportedTable RowsOf(const UnderstoodFile& file, const ImportOptions& options);

/// Adds the joints of a second file to the rows of the first one: by number or name if both files
/// have that column (several measured rows may share one posture), else by the evidence of
/// PairingOf(); the files must then have the same number of rows. The result has the rejected lines
/// of both files.
/// If both have t_s, it counts from the earlier of their first time stamps; without stamps in both,
/// t_s of the joints is left out.
/// @param faults  receives the fault if the rows cannot be matched, and one for each number or name
///                that two lines of the joints have
ImportedTable WithJoints(ImportedTable measured, ImportedTable joints,
                         const std::string& joints_file, config::FaultList& faults);

/// Moves rows that lack a joint to the rejected lines: measured.csv has no place for them. Required
/// are all joint columns that any row has.
void RejectRowsWithoutJoints(ImportedTable& table);

/// The rows as measured.csv; columns without a value in any row are left out.
std::string MeasuredCsv(const ImportedTable& table);

}  // namespace plumbline::measure
