// Header of a table: the columns of the format, and which of them a file has.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/fault.h"
#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

// Fields of a line of a CSV file.

/// Without blanks, tabs and carriage returns at either end.
std::string_view Trimmed(std::string_view text);

/// Removes the text before `separator` from the front of `rest` and returns it; all of it if there
/// is no separator.
std::string_view TakeUntil(char separator, std::string_view& rest);

/// Splits a line at its commas into trimmed fields, which refer to `line`.
void SplitFields(std::string_view line, std::vector<std::string_view>& fields);

/// A field for display in a message: quoted, shortened, without unprintable characters.
std::string Shown(std::string_view field);

/// A column's name for display in a message: likewise, without quotes.
std::string ShownName(std::string_view name);

/// Columns of a table: the format has about 60 for the largest robot; the others are signals of the
/// user's own. A row takes memory for each.
inline constexpr int kMaxColumns = 256;

enum class Quantity {
  kSession,
  kTime,
  kQ,
  kQd,
  kQdd,
  kTau,
  kPayload,
  kTool,
  kPayloadItem,
  kTemperature,
  kPosition,
  kRange,
  kOrientation,
  kJointStep,
  kArtefact,
  kGauge,
  kSigma,
  kCamera,
  kFurther,
  kUnused,
};

/// Meaning of a column: its quantity, component and factor to SI.
struct Column {
  std::string name;
  Quantity quantity = Quantity::kUnused;
  int index = 0;
  double to_si = 1;
};

/// The columns of a file, in its order.
struct TableHeader {
  std::vector<Column> columns;
  RecordedColumns recorded;
  std::vector<std::string> further;  ///< names of columns that are not part of the format
};

/// Reads a header line. All faults are reported: a missing column of a joint or of an incomplete
/// group, a column twice, a column of a joint that the cell lacks. A column that is not part of the
/// format becomes an additional signal, with a warning.
/// @return  nullopt if there is a fault
std::optional<TableHeader> HeaderFromCsv(std::string_view line, const std::string& file,
                                         const std::vector<model::Joint>& joints,
                                         config::FaultList& faults);

// Values of a row: a field of the file parsed as the quantity of its column.

/// The number in a field; infinity if it is not a number.
double NumberOrInfinity(std::string_view field);

/// Why a row whose field `camera` names none cannot be used; without the field.
inline constexpr std::string_view kNotACamera =
    "is not a camera: write side, rear, front or top, or two of them joined by + for their mean";

/// Parses a field and stores it in the row, in SI units. Empty cells of a measured table are stored
/// as NaN for FillEmptyCells().
/// @param row  has its vectors at their sizes; positions and orientations start at zero
/// @return     why the row cannot be used with this field, or an empty string
std::string StoreField(const Column& column, std::string_view field, TableUse use,
                       MeasuredRow& row);

}  // namespace plumbline::measure
