// Points of a calibration board in one image.
#pragma once

#include <string>
#include <vector>

#include "app/base/target/board.h"
#include "firmware-like/lens/lens.h"

namespace plumbline::vision {

/// The board's points as detected in one frame.
struct BoardView {
  std::string name;                    ///< of the frame, for messages
  double time_s = 0;                   ///< monotonic, or the frame's number if there is no clock
  std::vector<lens::Vec2> corners_px;  ///< Board::corners() points, row by row
  std::vector<bool> seen;              ///< if false, hidden or outside: the position is meaningless
  double blur_px = 0;                  ///< width of the edges, standard deviation
};

/// The view with its points numbered as on the turned board.
BoardView Turned(const BoardView& view, const target::BoardTurn& turn);

}  // namespace plumbline::vision
