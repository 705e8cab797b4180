// Columns in another unit than declared, in all rows, from one line on or up to it.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/hypotheses/mistakes.h"

namespace plumbline::measure {

// Detection of a change of the payload's unit within the table: converted, the values repeat those
// of the other rows.

/// Payloads in pounds or grams on one side of a change. Requires recorded payloads.
std::vector<Mistake> PayloadUnitChanges(const Dataset& data);

/// Detects payloads entered in grams: read as kilograms, they exceed what any robot carries. The
/// reader has excluded their rows (MeasuredTable::excessive_payloads).
/// @return  a sentence with the evidence and a remedy
std::optional<std::string> PayloadsInGrams(const MeasuredTable& table);

// Units that the numbers of a column may really be in, other than the unit of its name.

/// A column, or several that are wrong together, and the unit its numbers may really be in.
struct OtherUnit {
  std::string columns;   ///< "q2_deg", "x_mm, y_mm, z_mm"
  std::string unit;      ///< of the numbers: "radians"
  std::string declared;  ///< stated by the column name: "degrees"
  std::vector<std::function<double(const MeasuredRow&)>> numbers;
  /// Converts the numbers of one row to the declared unit.
  std::function<void(Dataset&, RowIndex)> convert;
};

/// Angles of a revolute joint (0-based) in radians.
OtherUnit InRadians(int joint);
OtherUnit PayloadIn(const std::string& unit, double factor);

/// Payload units other than kilograms, with their size in kilograms.
inline constexpr std::array<std::pair<double, const char*>, 2> kPayloadUnits = {
    {{0.45359237, "pounds"}, {1e-3, "grams"}}};

/// True if the joint (0-based) is revolute; its column is then in degrees.
bool IsRevolute(const Dataset& data, int joint);
/// True if the model uses the payload's weight: it is recorded, and the cell has a [payload].
bool UsesPayload(const Dataset& data);

/// Every column that affects the predicted or measured tip, in each unit commonly mistaken for it.
std::vector<OtherUnit> OtherUnits(const Dataset& data);

// Detection of columns whose unit changes within the table, from their numbers alone.

/// Unit changes that are visible in a column's numbers alone: of the payload (pounds, grams), if
/// the rows on one side of the change, converted, repeat the payloads of the other side; of a
/// revolute joint (radians), if no angle on one side exceeds a turn in radians and those of the
/// other side do by far. Each is subtle (Mistake::subtle): a light payload, or a joint whose axis
/// passes through the tool, moves the tip by less than effects do.
std::vector<Mistake> UnitChanges(const Dataset& data);

/// Fewer rows on one side of a change are single wrong rows instead of another unit.
inline constexpr int kMinRowsPerSide = 4;

/// The rows from a change on, or those before it.
struct RowSegment {
  RowIndex change;
  bool from = true;

  bool Contains(RowIndex row) const { return from == (row >= change); }
  /// @param rows  of the data set
  int Count(int rows) const { return from ? rows - change.value() : change.value(); }
  /// True if both sides of the change are long enough.
  bool IsLong(int rows) const;
};

/// A segment by its line in the file, which is independent of thinning.
struct LineSegment {
  int line = 0;  ///< first line (if `from`) or last line of the segment
  bool from = true;

  bool Contains(const MeasuredRow& row) const { return from ? row.line >= line : row.line <= line; }
  std::string Text() const;    ///< "from line 12", "up to line 12"
  std::string Phrase() const;  ///< "from line 12 on", "up to line 12"
};

/// The lines of a segment of the rows.
LineSegment LinesOf(const Dataset& data, const RowSegment& segment);

/// Converts the rows of a segment to the declared unit of the column.
void Convert(const OtherUnit& other, const LineSegment& lines, Dataset& data);

/// The subtle mistake that a column is in another unit in these lines.
Mistake SubtleChange(const OtherUnit& other, const LineSegment& lines);

/// Adds a note if temp_C, in all rows or in some, is hotter than a cell usually is, but an ordinary
/// temperature when read as degrees Fahrenheit.
void NoteLikelyFahrenheit(MeasuredTable& table);

/// The hypothesis that these temperatures are in degrees Fahrenheit; nullopt if there are none.
/// Whether it is right is for the fit to decide: motors and heated cells do get that hot.
std::optional<Mistake> FahrenheitMistake(const Dataset& data);

}  // namespace plumbline::measure
