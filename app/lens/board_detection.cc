#include "app/lens/board_detection.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "app/lens/board_lattice.h"
#include "app/lens/corner_refinement.h"

namespace plumbline {
namespace {

constexpr int kSearchWidth_px = 960;
constexpr double kSmooth_px = 1.2;
constexpr double kRing_px = 4;  // smaller than the smallest square, at the search size
constexpr std::size_t kMostPoints = 3000;
constexpr double kLeastSeen = 0.85;  // share of the corners that make a whole board

/// Counter-clockwise quarter turns of the lattice; the board stays unmirrored.
Lattice Turned(const Lattice& lattice) {
  Lattice turned{lattice.rows, lattice.columns, {}};
  turned.points.resize(lattice.points.size());
  for (int row = 0; row < turned.rows; ++row) {
    for (int column = 0; column < turned.columns; ++column) {
      turned.points[static_cast<std::size_t>(row) * turned.columns + column] =
          lattice.At(lattice.columns - 1 - row, column);
    }
  }
  return turned;
}

/// Of the turns that fit the board, the one whose first corner is nearest to the top left.
Lattice Upright(Lattice lattice, const Board& board, const std::vector<SaddlePoint>& points) {
  Lattice best;
  double least = 0;
  for (int turn = 0; turn < 4; ++turn) {
    lattice = Turned(lattice);
    if (lattice.columns != board.columns || lattice.rows != board.rows) continue;
    double along = 0;  // of the first row against the last one
    for (int column = 0; column < lattice.columns; ++column) {
      const int first = lattice.At(column, 0), last = lattice.At(column, lattice.rows - 1);
      if (first >= 0 && last >= 0) along += (points[first].at - points[last].at).sum();
    }
    if (best.points.empty() || along < least) {
      least = along;
      best = lattice;
    }
  }
  return best;
}

bool Fits(const Lattice& lattice, const Board& board) {
  return lattice.found() >= kLeastSeen * board.corners() &&
         ((lattice.columns == board.columns && lattice.rows == board.rows) ||
          (lattice.columns == board.rows && lattice.rows == board.columns));
}

Error Misfit(const std::vector<Lattice>& lattices, const Board& board) {
  // Textures hang together as well, but in ragged pieces.
  if (lattices.empty() || lattices[0].found() < board.corners() / 6 ||
      2 * lattices[0].found() < lattices[0].columns * lattices[0].rows)
    return {"no chessboard"};
  const Lattice& largest = lattices[0];
  const int longer = std::max(largest.columns, largest.rows);
  const int shorter = std::min(largest.columns, largest.rows);
  if (largest.found() == largest.columns * largest.rows && largest.found() != board.corners() &&
      (longer > std::max(board.columns, board.rows) ||
       shorter > std::min(board.columns, board.rows))) {
    return {fmt::format("a board of {} x {} inner corners instead of {} x {}: check --board",
                        longer, shorter, board.columns, board.rows)};
  }
  return {fmt::format("only a part of the board: {} of {} corners ({} x {})", largest.found(),
                      board.corners(), longer, shorter)};
}

/// From the neighbours on both sides where there are two.
std::vector<LatticeSteps> StepsOf(const BoardView& view, const Board& board) {
  const auto step = [&](int column, int row, int dx, int dy) {
    Vec2 sum = Vec2::Zero();
    int count = 0;
    const int here = row * board.columns + column;
    for (const int side : {-1, 1}) {
      const int c = column + side * dx, r = row + side * dy;
      if (c < 0 || r < 0 || c >= board.columns || r >= board.rows) continue;
      const int other = r * board.columns + c;
      if (!view.seen[other] || !view.seen[here]) continue;
      sum += side * (view.corners_px[other] - view.corners_px[here]);
      ++count;
    }
    return count > 0 ? Vec2(sum / count) : sum;
  };
  std::vector<LatticeSteps> steps;
  for (int k = 0; k < board.corners(); ++k) {
    const int column = k % board.columns, row = k / board.columns;
    steps.push_back({step(column, row, 1, 0), step(column, row, 0, 1)});
  }
  return steps;
}

}  // namespace

Result<BoardView> DetectBoard(const LumaView& image, const Board& board) {
  const int factor = std::max(1, (image.width + kSearchWidth_px / 2) / kSearchWidth_px);
  if (image.width / factor < 4 * kRing_px || image.height / factor < 4 * kRing_px)
    return Error{fmt::format("the image is only {} x {} px", image.width, image.height)};
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  // A multiple of the factor, so that a small pixel is exactly the mean of its large ones.
  const cv::Mat even =
      whole(cv::Rect(0, 0, image.width / factor * factor, image.height / factor * factor));
  cv::Mat small, small_float, smooth;
  cv::resize(even, small, {image.width / factor, image.height / factor}, 0, 0, cv::INTER_AREA);
  small.convertTo(small_float, CV_32F);
  cv::GaussianBlur(small_float, smooth, {0, 0}, kSmooth_px, kSmooth_px, cv::BORDER_REPLICATE);
  const std::vector<SaddlePoint> points = FindSaddlePoints(smooth, kRing_px, kMostPoints);
  const std::vector<Lattice> lattices = FindLattices(points);
  const auto fitting = std::find_if(lattices.begin(), lattices.end(),
                                    [&](const Lattice& lattice) { return Fits(lattice, board); });
  if (fitting == lattices.end()) return Misfit(lattices, board);
  BoardView view;
  for (const int point : Upright(*fitting, board, points).points) {
    view.seen.push_back(point >= 0);
    view.corners_px.push_back(
        point < 0 ? Vec2::Zero()
                  : Vec2(factor * points[point].at + Vec2::Constant(0.5 * (factor - 1))));
  }
  RefineCorners(image, StepsOf(view, board), view);
  return view;
}

}  // namespace plumbline
