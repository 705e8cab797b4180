// What a calibration needs to be done again, as it is kept with the lens.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "app/lens/board.h"
#include "firmware-like/result.h"

namespace plumbline {

struct StoredViews {
  Board board;
  std::vector<BoardView> views;  ///< in order of time
};

/// As JSON, to be read with the sqlite3 command too: the board, and of each view its time, the
/// width of its edges, and [u, v] of each point row by row, null where it was not seen. Rounded to
/// 1e-5 px, a thousandth of what a corner errs by.
std::vector<std::uint8_t> BytesOfViews(const StoredViews& stored);

/// @return  or what is wrong with them: no JSON, another schema, no board, other numbers of points
Result<StoredViews> ViewsOfBytes(std::span<const std::uint8_t> bytes);

}  // namespace plumbline
