// The board that the commands' tests render.
#pragma once

#include "tests/renderer/scene.h"

namespace plumbline::test {

/// A chessboard of 9 x 6 inner corners 20 mm apart, its first corner at the origin of its frame.
inline renderer::Sheet BoardSheet() {
  renderer::Sheet sheet;
  sheet.print = renderer::Chessboard(9, 6, 0.02);
  sheet.half_width_m = 0.12;
  sheet.half_height_m = 0.09;
  sheet.centre_x_m = 0.08;
  sheet.centre_y_m = 0.05;
  return sheet;
}

}  // namespace plumbline::test
