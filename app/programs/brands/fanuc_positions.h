// The points of a FANUC TP program: its section /POS.
#pragma once

#include <cstddef>
#include <map>

#include "app/programs/brands/source_cursor.h"
#include "app/programs/program.h"

namespace plumbline::programs::fanuc {

/// Keys of the frames, tools and payloads of a controller.
inline std::string ToolKey(long number) {
  return "UTOOL " + std::to_string(number);
}
inline std::string BaseKey(long number) {
  return "UFRAME " + std::to_string(number);
}
inline std::string LoadKey(long number) {
  return "PAYLOAD " + std::to_string(number);
}

/// Indices in Program::points by the number of the point, P[n].
using PointNumbers = std::map<long, std::size_t>;

/// Reads `P[n:"label"]{ GPg: UF : u, UT : t, CONFIG : 'N U T, 0, 0, 0', X = ...}` from `section`
/// and appends the points. The robot is group 1; the axes of the other groups are external axes of
/// the same point, and so are E1.. of group 1. A pose of another group is a point of its own that
/// must stay, and so are untaught points (`********`) and those of a tool that stands in the cell
/// (RX, RY ..).
PointNumbers ReadPositions(SourceCursor section, const LineIndex& lines, Program& program);

}  // namespace plumbline::programs::fanuc
