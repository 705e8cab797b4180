#include "app/measure/diagnosis/unit_segment.h"

#include <fmt/format.h>

namespace plumbline::measure {

bool RowSegment::IsLong(int rows) const {
  return change.value() >= kMinRowsPerSide && rows - change.value() >= kMinRowsPerSide;
}

std::string LineSegment::Text() const {
  return fmt::format("{} line {}", from ? "from" : "up to", line);
}

std::string LineSegment::Phrase() const {
  return from ? Text() + " on" : Text();
}

LineSegment LinesOf(const Dataset& data, const RowSegment& segment) {
  const RowIndex row = segment.from ? segment.change : RowIndex(segment.change.value() - 1);
  return {data.measured(row).line, segment.from};
}

void Convert(const OtherUnit& other, const LineSegment& lines, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    if (lines.Contains(data.measured(row))) other.convert(data, row);
  }
}

Mistake SubtleChange(const OtherUnit& other, const LineSegment& lines) {
  Mistake mistake{fmt::format("{} holds {} {}", other.columns, other.unit, lines.Phrase()),
                  fmt::format("write {} in every row", other.declared),
                  [other, lines](Dataset& changed) { Convert(other, lines, changed); }};
  mistake.subtle = true;
  mistake.affects = [lines](const MeasuredRow& row) { return lines.Contains(row); };
  return mistake;
}

}  // namespace plumbline::measure
