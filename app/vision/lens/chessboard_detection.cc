#include "app/vision/lens/chessboard_detection.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "app/vision/lens/board_corner_refinement.h"
#include "app/vision/lens/point_grid.h"
#include "app/vision/lens/saddle_points.h"

namespace plumbline::vision {
namespace {

// Grouping of saddle points into chessboard lattices.

/// A connected piece of a chessboard.
struct Lattice {
  int columns = 0, rows = 0;
  std::vector<int> points;  ///< row by row: index of the saddle point, or -1 if there is none

  int At(int column, int row) const {
    return points[static_cast<std::size_t>(row) * columns + column];
  }
  int found() const;
};

constexpr double kMaxAsideTangent = 0.3;    // tangent of a neighbour's largest angle to the edge
constexpr double kMaxEdgeAngle_rad = 0.35;  // between the edges of neighbours
constexpr std::size_t kNeighbourCandidates = 12;  // nearest points considered
constexpr int kMinCorners = 9;

double AngleBetween(double a, double b) {
  const double difference = std::fmod(std::abs(a - b), std::numbers::pi);
  return std::min(difference, std::numbers::pi - difference);
}

/// The neighbours of a corner in four directions: along edge [0], along edge [1], and their
/// opposites; -1 if there is none.
using Links = std::array<int, 4>;

lens::Vec2 DirectionOf(const SaddlePoint& point, int direction) {
  const double angle = point.edge_rad[direction % 2];
  return (direction < 2 ? 1 : -1) * lens::Vec2(std::cos(angle), std::sin(angle));
}

/// Direction in which `to` is a neighbour of `from`, or -1. The colours swap sides along an edge,
/// so edge [0] of one corner continues as edge [1] of its neighbour.
int LinkDirection(const SaddlePoint& from, const SaddlePoint& to) {
  const lens::Vec2 step = to.at - from.at;
  for (int direction = 0; direction < 4; ++direction) {
    const lens::Vec2 along = DirectionOf(from, direction);
    const double ahead = along.dot(step);
    const double aside = std::abs(along.x() * step.y() - along.y() * step.x());
    if (ahead <= 0 || aside > kMaxAsideTangent * ahead) continue;
    if (AngleBetween(from.edge_rad[direction % 2], to.edge_rad[1 - direction % 2]) >
        kMaxEdgeAngle_rad)
      continue;
    if (AngleBetween(from.edge_rad[1 - direction % 2], to.edge_rad[direction % 2]) >
        kMaxEdgeAngle_rad)
      continue;
    return direction;
  }
  return -1;
}

std::vector<Links> LinksOf(const std::vector<SaddlePoint>& points) {
  double extent = 1;
  for (const SaddlePoint& point : points) extent = std::max(extent, point.at.maxCoeff());
  const double size = std::max(8.0, extent / std::sqrt(static_cast<double>(points.size()) + 1));
  std::vector<lens::Vec2> positions;
  for (const SaddlePoint& point : points) positions.push_back(point.at);
  const PointGrid grid(std::move(positions), size);
  std::vector<Links> nearest(points.size(), Links{-1, -1, -1, -1});
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (const int other : grid.Nearest(static_cast<int>(k), kNeighbourCandidates, {1, 2, 3, 4})) {
      const int direction = LinkDirection(points[k], points[other]);
      if (direction >= 0 && nearest[k][direction] < 0) nearest[k][direction] = other;
    }
  }
  // A link must be mutual.
  std::vector<Links> links = nearest;
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (int& link : links[k]) {
      if (link < 0) continue;
      const Links& back = nearest[link];
      if (std::ranges::find(back, static_cast<int>(k)) == back.end()) link = -1;
    }
  }
  return links;
}

struct Place {
  int column, row;
  auto operator<=>(const Place&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// Numbers all corners connected to `seed`. The board's two axes at each corner follow from those
/// of the corner it was reached from.
std::map<Place, int> NumberFrom(const std::vector<SaddlePoint>& points,
                                const std::vector<Links>& links, int seed,
                                std::vector<bool>& taken) {
  struct Step {
    int point;
    Place place;
    lens::Vec2 x, y;  ///< local axes of the board, unit vectors in the image
  };
  std::map<Place, int> lattice;
  std::queue<Step> open;
  const lens::Vec2 x0 = DirectionOf(points[seed], 0), y0 = DirectionOf(points[seed], 1);
  open.push({seed, {0, 0}, x0, y0});
  taken[seed] = true;
  while (!open.empty()) {
    const Step step = open.front();
    open.pop();
    if (!lattice.emplace(step.place, step.point).second) continue;
    for (int direction = 0; direction < 4; ++direction) {
      const int next = links[step.point][direction];
      if (next < 0 || taken[next]) continue;
      const lens::Vec2 along = DirectionOf(points[step.point], direction);
      const double on_x = along.dot(step.x), on_y = along.dot(step.y);
      Place place = step.place;
      if (std::abs(on_x) > std::abs(on_y)) {
        place.column += on_x > 0 ? 1 : -1;
      } else {
        place.row += on_y > 0 ? 1 : -1;
      }
      // The neighbour's axes are those of its directions closest to ours.
      Step onward{next, place, lens::Vec2::Zero(), lens::Vec2::Zero()};
      double best_x = -2, best_y = -2;
      for (int k = 0; k < 4; ++k) {
        const lens::Vec2 axis = DirectionOf(points[next], k);
        if (axis.dot(step.x) > best_x) {
          best_x = axis.dot(step.x);
          onward.x = axis;
        }
        if (axis.dot(step.y) > best_y) {
          best_y = axis.dot(step.y);
          onward.y = axis;
        }
      }
      taken[next] = true;
      open.push(onward);
    }
  }
  return lattice;
}

Lattice PackLattice(const std::map<Place, int>& numbered, const std::vector<SaddlePoint>& points) {
  Place least{1 << 20, 1 << 20}, most{-(1 << 20), -(1 << 20)};
  for (const auto& [place, point] : numbered) {
    least = {std::min(least.column, place.column), std::min(least.row, place.row)};
    most = {std::max(most.column, place.column), std::max(most.row, place.row)};
  }
  Lattice lattice;
  lattice.columns = most.column - least.column + 1;
  lattice.rows = most.row - least.row + 1;
  lattice.points.assign(static_cast<std::size_t>(lattice.columns) * lattice.rows, -1);
  lens::Vec2 x = lens::Vec2::Zero(), y = lens::Vec2::Zero();
  const auto point_at = [&](Place place) {
    const auto found = numbered.find(place);
    return found == numbered.end() ? nullptr : &points[found->second];
  };
  for (const auto& [place, point] : numbered) {
    if (const auto* right = point_at({place.column + 1, place.row}))
      x += right->at - points[point].at;
    if (const auto* below = point_at({place.column, place.row + 1}))
      y += below->at - points[point].at;
  }
  const bool mirrored = x.x() * y.y() - x.y() * y.x() < 0;
  for (const auto& [place, point] : numbered) {
    int row = place.row - least.row;
    if (mirrored) row = lattice.rows - 1 - row;
    lattice.points[static_cast<std::size_t>(row) * lattice.columns + place.column - least.column] =
        point;
  }
  return lattice;
}

int Lattice::found() const {
  return static_cast<int>(std::ranges::count_if(points, [](int point) { return point >= 0; }));
}

/// Links neighbouring points along their edges and numbers each connected piece; largest first. Two
/// points are neighbours if each is the nearest along an edge of the other and their colours
/// alternate. Columns count to the right and rows down as far as the board's rotation allows; x
/// cross y points away from the viewer, so a lattice is never mirrored.
std::vector<Lattice> FindLattices(const std::vector<SaddlePoint>& points) {
  const std::vector<Links> links = LinksOf(points);
  std::vector<bool> taken(points.size(), false);
  std::vector<Lattice> lattices;
  for (std::size_t seed = 0; seed < points.size(); ++seed) {
    if (taken[seed]) continue;
    const std::map<Place, int> numbered = NumberFrom(points, links, static_cast<int>(seed), taken);
    if (numbered.size() >= kMinCorners) lattices.push_back(PackLattice(numbered, points));
  }
  std::ranges::stable_sort(
      lattices, [](const Lattice& a, const Lattice& b) { return a.found() > b.found(); });
  return lattices;
}

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

/// Whether the square before the first corner is dark, by the majority of the corners.
bool StartsDark(const Lattice& lattice, const std::vector<SaddlePoint>& points) {
  int votes = 0;
  for (int row = 0; row < lattice.rows; ++row) {
    for (int column = 0; column + 1 < lattice.columns; ++column) {
      const int here = lattice.At(column, row), next = lattice.At(column + 1, row);
      if (here < 0 || next < 0) continue;
      const lens::Vec2 step = points[next].at - points[here].at;
      const double along_row = std::atan2(step.y(), step.x());
      const auto& edges = points[here].edge_rad;
      const bool bright = AngleBetween(edges[0], along_row) < AngleBetween(edges[1], along_row);
      votes += bright == ((column + row) % 2 == 1) ? 1 : -1;
    }
  }
  return votes > 0;
}

/// The rotation that fits the board's size and has the first corner at a dark square, if one has;
/// of several, that with the first corner nearest to the top left.
Lattice ChooseUpright(Lattice lattice, const target::Board& board,
                      const std::vector<SaddlePoint>& points) {
  Lattice best;
  bool best_dark = false;
  double least = 0;
  for (int turn = 0; turn < 4; ++turn) {
    lattice = Rotated(lattice);
    if (lattice.columns != board.columns || lattice.rows != board.rows) continue;
    const bool dark = StartsDark(lattice, points);
    if (best_dark && !dark) continue;
    double along = 0;  // u + v of the first row minus that of the last one
    for (int column = 0; column < lattice.columns; ++column) {
      const int first = lattice.At(column, 0), last = lattice.At(column, lattice.rows - 1);
      if (first >= 0 && last >= 0) along += (points[first].at - points[last].at).sum();
    }
    if (best.points.empty() || (dark && !best_dark) || along < least) {
      least = along;
      best_dark = dark;
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
