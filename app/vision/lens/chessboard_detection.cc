#include "app/vision/lens/chessboard_detection.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "app/vision/lens/board_corner_refinement.h"
#include "app/vision/lens/board_lattice.h"

namespace plumbline::vision {
namespace {

constexpr int kBoardWidth_px = 960;
constexpr double kSaddleSmooth_px = 1.2;
constexpr double kRing_px = 4;  // smaller than the smallest square, at the search size
constexpr int kMinWidth_px = 16;
constexpr std::size_t kMaxSaddles = 3000;
constexpr double kMinCornersSeen = 0.85;  // share of the corners for a board to count as complete
constexpr double kMaxCornersBeside =
    0.08;  // share of extra points that may be linked to its border

/// The lattice rotated by a quarter turn counter-clockwise; never mirrored.
Lattice Rotated(const Lattice& lattice) {
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

/// The rotation that fits the board's size with the first corner nearest to the top left.
Lattice ChooseUpright(Lattice lattice, const target::Board& board,
                      const std::vector<SaddlePoint>& points) {
  Lattice best;
  double least = 0;
  for (int turn = 0; turn < 4; ++turn) {
    lattice = Rotated(lattice);
    if (lattice.columns != board.columns || lattice.rows != board.rows) continue;
    double along = 0;  // u + v of the first row minus that of the last one
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

/// The board within a lattice, which may have texture linked to its border. Nullopt if no part of
/// the board's size is nearly complete, or if too much lies outside of it.
std::optional<Lattice> ChessboardWithin(const Lattice& lattice, const target::Board& board) {
  Lattice best;
  int most = 0;
  for (const auto& [columns, rows] :
       {std::pair(board.columns, board.rows), {board.rows, board.columns}}) {
    for (int row = 0; row + rows <= lattice.rows; ++row) {
      for (int column = 0; column + columns <= lattice.columns; ++column) {
        Lattice part{columns, rows, {}};
        for (int r = row; r < row + rows; ++r) {
          for (int c = column; c < column + columns; ++c) part.points.push_back(lattice.At(c, r));
        }
        if (part.found() <= most) continue;
        most = part.found();
        best = std::move(part);
      }
    }
  }
  if (most < kMinCornersSeen * board.corners() ||
      lattice.found() - most > kMaxCornersBeside * board.corners())
    return std::nullopt;
  return best;
}

Error DescribeMismatch(const std::vector<Lattice>& lattices, const target::Board& board) {
  // Texture forms lattices as well, but ragged ones.
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

/// Lattice vectors at each corner, averaged over the neighbours on both sides where both exist.
std::vector<LatticeSteps> StepsOf(const BoardView& view, const target::Board& board) {
  const auto step = [&](int column, int row, int dx, int dy) {
    lens::Vec2 sum = lens::Vec2::Zero();
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
    return count > 0 ? lens::Vec2(sum / count) : sum;
  };
  std::vector<LatticeSteps> steps;
  for (int k = 0; k < board.corners(); ++k) {
    const int column = k % board.columns, row = k / board.columns;
    steps.push_back({step(column, row, 1, 0), step(column, row, 0, 1)});
  }
  return steps;
}

/// Lattices found in the reduced image.
struct Search {
  int factor = 1;  ///< reduction: image pixels per reduced pixel
  std::vector<SaddlePoint> points;
  std::vector<Lattice> lattices;  ///< the largest first
};

Result<Search> SearchLattices(const image::LumaView& image) {
  Search search;
  search.factor = std::max(1, (image.width + kBoardWidth_px / 2) / kBoardWidth_px);
  const int factor = search.factor;
  if (std::min(image.width, image.height) / factor < kMinWidth_px)
    return Error{fmt::format("the image is only {} x {} px", image.width, image.height)};
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  // Cropped to a multiple of the factor, so that each reduced pixel is the mean of whole pixels.
  const cv::Mat even =
      whole(cv::Rect(0, 0, image.width / factor * factor, image.height / factor * factor));
  cv::Mat small, small_float, smooth;
  cv::resize(even, small, {image.width / factor, image.height / factor}, 0, 0, cv::INTER_AREA);
  small.convertTo(small_float, CV_32F);
  cv::GaussianBlur(small_float, smooth, {0, 0}, kSaddleSmooth_px, kSaddleSmooth_px,
                   cv::BORDER_REPLICATE);
  search.points = FindSaddlePoints(smooth, kRing_px, kMaxSaddles);
  search.lattices = FindLattices(search.points);
  return search;
}

}  // namespace

std::optional<std::pair<int, int>> WholeChessboardIn(const image::LumaView& image) {
  constexpr int kMinCount = 3;  // shorter rows occur in any texture
  const Result<Search> search = SearchLattices(image);
  if (!search || search->lattices.empty()) return std::nullopt;
  const Lattice& largest = search->lattices[0];
  const auto [shorter, longer] = std::minmax(largest.columns, largest.rows);
  if (shorter < kMinCount || largest.found() != largest.columns * largest.rows) return std::nullopt;
  return std::pair(longer, shorter);
}

Result<BoardView> DetectChessboard(const image::LumaView& image, const target::Board& board) {
  const Result<Search> search = SearchLattices(image);
  if (!search) return search.failure();
  const int factor = search->factor;
  const std::vector<SaddlePoint>& points = search->points;
  const std::vector<Lattice>& lattices = search->lattices;
  std::optional<Lattice> fitting;
  for (std::size_t k = 0; k < lattices.size() && !fitting; ++k)
    fitting = ChessboardWithin(lattices[k], board);
  if (!fitting) return DescribeMismatch(lattices, board);
  BoardView view;
  for (const int point : ChooseUpright(*fitting, board, points).points) {
    view.seen.push_back(point >= 0);
    view.corners_px.push_back(point < 0 ? lens::Vec2::Zero()
                                        : lens::Vec2(factor * points[point].at +
                                                     lens::Vec2::Constant(0.5 * (factor - 1))));
  }
  RefineCorners(image, StepsOf(view, board), view);
  return view;
}

}  // namespace plumbline::vision
