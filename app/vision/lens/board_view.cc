#include "app/vision/lens/board_view.h"

namespace plumbline::vision {

BoardView Turned(const BoardView& view, const target::BoardTurn& turn) {
  BoardView turned = view;
  for (std::size_t k = 0; k < turn.points.size(); ++k) {
    const auto from = static_cast<std::size_t>(turn.points[k]);
    turned.corners_px[k] = view.corners_px[from];
    turned.seen[k] = view.seen[from];
  }
  return turned;
}

}  // namespace plumbline::vision
