// Part of a table in which a column is in another unit: from one line on, or up to it.
#pragma once

#include <string>

#include "app/measure/diagnosis/column_units.h"
#include "app/measure/diagnosis/dataset.h"
#include "app/measure/diagnosis/mistakes.h"

namespace plumbline::measure {

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

}  // namespace plumbline::measure
