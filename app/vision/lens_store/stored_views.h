// Encoding of the board views that are stored with a lens, so that it can be solved again.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

struct StoredViews {
  target::Board board;
  std::vector<BoardView> views;  ///< in order of time
};

/// JSON, also readable with the sqlite3 command: the board, and for each view its time, edge width,
/// and [u, v] of each point row by row, null if not seen. Rounded to 1e-5 px, a thousandth of a
/// corner's error.
std::vector<std::uint8_t> EncodeViews(const StoredViews& stored);

/// @return  an error if the bytes are not JSON or have another schema, an invalid board or a wrong
///          number of points
Result<StoredViews> DecodeViews(std::span<const std::uint8_t> bytes);

}  // namespace plumbline::vision
