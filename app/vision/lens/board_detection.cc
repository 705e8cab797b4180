#include "app/vision/lens/board_detection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <optional>

#include "app/base/target/board.h"
#include "app/vision/lens/board_corner_refinement.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/chessboard_detection.h"
#include "app/vision/lens/circle_detection.h"
#include "app/vision/tracking/tag_detector.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::vision {
namespace {

// Detection of a complete or partly visible ChArUco board in one frame.

constexpr std::size_t kMinTags = 2;
constexpr int kMinCharucoCorners = 8;
constexpr double kMaxTagOffset = 0.35;  // of a tag's side, from the common homography
constexpr double kMoved = 0.12;         // of a step: largest refinement
constexpr double kColourProbe = 0.6;    // of the tags' margin: where a square's colour is sampled
constexpr double kColourProbeAlong = 0.42;  // of a step: likewise along the edges
constexpr double kMinContrast = 0.3;        // share of the tags' contrast

/// Layout of a ChArUco board: the squares that carry tags and the tags' positions.
class CharucoLayout {
 public:
  CharucoLayout(const target::Board& board, bool white_first)
      : board_(board), white_first_(white_first) {
    for (int row = 0; row <= board.rows; ++row) {
      for (int column = 0; column <= board.columns; ++column) {
        if (White(column, row)) squares_.emplace_back(column, row);
      }
    }
  }
  /// Squares are counted from the top left one, which has corner 0 at its lower right.
  bool White(int column, int row) const { return ((column + row) % 2 == 0) == white_first_; }
  int count() const { return static_cast<int>(squares_.size()); }
  std::pair<int, int> Square(int id) const { return squares_[id]; }
  /// The tag's corners in the frame K [m], clockwise from its top left.
  std::array<lens::Vec2, 4> Corners(int id) const {
    const lens::Vec2 middle =
        board_.square_m * lens::Vec2(squares_[id].first - 0.5, squares_[id].second - 0.5);
    const double h = 0.5 * board_.marker_m;
    return {middle + lens::Vec2(-h, -h), middle + lens::Vec2(h, -h), middle + lens::Vec2(h, h),
            middle + lens::Vec2(-h, h)};
  }

 private:
  const target::Board& board_;
  bool white_first_;
  std::vector<std::pair<int, int>> squares_;
};

lens::Vec2 Mapped(const Eigen::Matrix3d& H, const lens::Vec2& p) {
  return (H * p.homogeneous()).hnormalized();
}

std::optional<Eigen::Matrix3d> TagHomography(const std::vector<cv::Point2d>& board,
                                             const std::vector<cv::Point2d>& image, double within) {
  const cv::Mat H = cv::findHomography(board, image, within > 0 ? cv::RANSAC : 0, within);
  if (H.empty()) return std::nullopt;
  Eigen::Matrix3d homography;
  cv::cv2eigen(H, homography);
  if (!homography.allFinite()) return std::nullopt;
  return homography;
}

std::optional<Eigen::Matrix3d> TagHomography(const CharucoLayout& tags,
                                             const std::vector<SeenTag>& seen, double within) {
  std::vector<cv::Point2d> board, image;
  for (const SeenTag& tag : seen) {
    const auto corners = tags.Corners(tag.id);
    for (std::size_t k = 0; k < 4; ++k) {
      board.emplace_back(corners[k].x(), corners[k].y());
      image.emplace_back(tag.corners_px[k].x(), tag.corners_px[k].y());
    }
  }
  return TagHomography(board, image, within);
}

/// The tags that agree with a common homography of the board.
std::vector<SeenTag> TagsInPlace(const CharucoLayout& tags, const std::vector<SeenTag>& seen) {
  std::vector<SeenTag> known;
  double side = 1e9;
  for (const SeenTag& tag : seen) {
    if (tag.id >= tags.count()) continue;
    known.push_back(tag);
    side = std::min(side, (tag.corners_px[2] - tag.corners_px[0]).norm() / std::sqrt(2.0));
  }
  if (known.size() < kMinTags) return {};
  const auto H = TagHomography(tags, known, kMaxTagOffset * side);
  if (!H) return {};
  std::erase_if(known, [&](const SeenTag& tag) {
    const auto corners = tags.Corners(tag.id);
    const double limit = kMaxTagOffset * (tag.corners_px[2] - tag.corners_px[0]).norm();
    for (std::size_t k = 0; k < 4; ++k) {
      if ((Mapped(*H, corners[k]) - tag.corners_px[k]).norm() > limit) return true;
    }
    return false;
  });
  return known;
}

/// Bilinear interpolation, clamped at the image border.
double GreyAt(const image::LumaView& image, const lens::Vec2& at) {
  const double x = std::clamp(at.x(), 0.0, image.width - 1.001);
  const double y = std::clamp(at.y(), 0.0, image.height - 1.001);
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double a = x - u, b = y - v;
  const std::uint8_t *top = image.row(v) + u, *bottom = image.row(v + 1) + u;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * bottom[0] + a * bottom[1]);
}

/// Predicts the corners adjacent to the tags: the mean over each tag's own homography, so that lens
/// distortion does not matter.
void PlaceCorners(const target::Board& board, const CharucoLayout& tags,
                  const std::vector<SeenTag>& seen, BoardView& view,
                  std::vector<LatticeSteps>& steps, std::vector<double>& contrast) {
  std::vector<int> votes(board.corners(), 0);
  for (const SeenTag& tag : seen) {
    const auto H = TagHomography(tags, {tag}, 0);
    if (!H) continue;
    const auto [column, row] = tags.Square(tag.id);
    for (const auto& [c, r] :
         {std::pair{column - 1, row - 1}, {column, row - 1}, {column, row}, {column - 1, row}}) {
      if (c < 0 || r < 0 || c >= board.columns || r >= board.rows) continue;
      const int k = r * board.columns + c;
      const lens::Vec2 at = board.Corner(k);
      const double half = 0.25 * board.square_m;
      view.corners_px[k] += Mapped(*H, at);
      steps[k].along_row +=
          2 * (Mapped(*H, at + lens::Vec2(half, 0)) - Mapped(*H, at - lens::Vec2(half, 0)));
      steps[k].down_column +=
          2 * (Mapped(*H, at + lens::Vec2(0, half)) - Mapped(*H, at - lens::Vec2(0, half)));
      contrast[k] += tag.contrast;
      ++votes[k];
    }
  }
  for (int k = 0; k < board.corners(); ++k) {
    view.seen[k] = votes[k] > 0;
    if (votes[k] == 0) continue;
    view.corners_px[k] /= votes[k];
    steps[k].along_row /= votes[k];
    steps[k].down_column /= votes[k];
    contrast[k] /= votes[k];
  }
}

/// Whether the four squares at a corner are dark and bright as printed, near it and along the four
/// edges as far as the refinement uses them. If not, something covers the corner.
bool ColoursMatch(const image::LumaView& image, const target::Board& board,
                  const CharucoLayout& tags, int k, const lens::Vec2& at, const LatticeSteps& steps,
                  double contrast) {
  const double near = kColourProbe * 0.5 * (1 - board.marker_m / board.square_m);
  double darkest_white = 255, brightest_black = 0;
  for (const auto& [a, b] :
       {std::pair{near, near}, {kColourProbeAlong, near}, {near, kColourProbeAlong}}) {
    for (const int right : {0, 1}) {
      for (const int down : {0, 1}) {
        const double grey = GreyAt(image, at + (2 * right - 1) * a * steps.along_row +
                                              (2 * down - 1) * b * steps.down_column);
        if (tags.White(k % board.columns + right, k / board.columns + down)) {
          darkest_white = std::min(darkest_white, grey);
        } else {
          brightest_black = std::max(brightest_black, grey);
        }
      }
    }
  }
  return darkest_white - brightest_black > kMinContrast * contrast;
}

/// Whether the corners span several rows and columns; a single row determines no homography.
bool SpansRowsAndColumns(const target::Board& board, const BoardView& view) {
  std::vector<bool> columns(board.columns, false), rows(board.rows, false);
  for (int k = 0; k < board.corners(); ++k) {
    if (!view.seen[k]) continue;
    columns[k % board.columns] = true;
    rows[k / board.columns] = true;
  }
  return std::ranges::count(columns, true) > 1 && std::ranges::count(rows, true) > 1;
}

/// Decodes the board's tags, predicts the adjacent corners by each tag's own homography, and
/// refines those whose four squares have the expected colours. A part of the board is enough,
/// because the tags identify it. Tags are numbered row by row over the white squares from the top
/// left. The top left square is black, or white on OpenCV's older boards with an even number of
/// rows; both layouts are tried. Run time is bounded as for tag detection.
/// @return  the view without its name and time, or why there is none: "no tag of aruco-6x6-250",
///          tags not arranged as on this board, too few corners
Result<BoardView> DetectCharuco(const image::LumaView& image, const target::Board& board) {
  auto family = target::TagFamilyOfName(board.family);
  if (!family) return family.failure();
  TagDetector detector(std::move(family).value(), {.small_tags = true});
  SeenTags seen;
  detector.Detect(image, nullptr, seen);
  if (seen.tags.empty()) return Error{fmt::format("no tag of {}", board.family)};
  const CharucoLayout black_first(board, false), white_first(board, true);
  const std::vector<SeenTag> black = TagsInPlace(black_first, seen.tags);
  const std::vector<SeenTag> white = TagsInPlace(white_first, seen.tags);
  const bool starts_white = white.size() > black.size();
  const CharucoLayout& tags = starts_white ? white_first : black_first;
  const std::vector<SeenTag>& in_place = starts_white ? white : black;
  const auto known =
      std::ranges::count_if(seen.tags, [&](const SeenTag& tag) { return tag.id < tags.count(); });
  if (in_place.size() < kMinTags || 2 * static_cast<std::ptrdiff_t>(in_place.size()) <= known) {
    return Error{
        fmt::format("{} tags of {}, but not arranged as on a board of {} x {} inner corners: check "
                    "--board and --family",
                    seen.tags.size(), board.family, board.columns, board.rows)};
  }
  // Tags that continue below the declared rows mean that the board is larger.
  target::Board longer = board;
  longer.rows *= 2;
  const std::vector<SeenTag> more = TagsInPlace(CharucoLayout(longer, starts_white), seen.tags);
  if (std::ranges::any_of(more, [&](const SeenTag& tag) { return tag.id >= tags.count(); })) {
    return Error{fmt::format("a board of more than {} x {} inner corners: check --board",
                             board.columns, board.rows)};
  }
  BoardView view;
  view.corners_px.assign(board.corners(), lens::Vec2::Zero());
  view.seen.assign(board.corners(), false);
  std::vector<LatticeSteps> steps(board.corners());
  std::vector<double> contrast(board.corners(), 0);
  PlaceCorners(board, tags, in_place, view, steps, contrast);
  const std::vector<lens::Vec2> before = view.corners_px;
  RefineCorners(image, steps, view, 0.5 * (1 - board.marker_m / board.square_m));
  for (int k = 0; k < board.corners(); ++k) {
    if (!view.seen[k]) continue;
    const double step = std::min(steps[k].along_row.norm(), steps[k].down_column.norm());
    view.seen[k] = (view.corners_px[k] - before[k]).norm() < std::max(kMoved * step, 1.0) &&
                   ColoursMatch(image, board, tags, k, view.corners_px[k], steps[k], contrast[k]);
  }
  const auto count = std::ranges::count(view.seen, true);
  if (count < kMinCharucoCorners || !SpansRowsAndColumns(board, view)) {
    return Error{fmt::format("only {} of {} corners of the board, in {} of its tags", count,
                             board.corners(), in_place.size())};
  }
  return view;
}

constexpr double kMarked = 0.5, kUnmarked = 0.25;  // brightness where the mark is printed

/// Brightness where a mark would be if the points of the view are in the right order: 0 as dark as
/// around it, 1 as bright as the white next to it. Nullopt if the points there were not seen.
std::optional<double> BrightnessOfMark(const image::LumaView& image, const target::Board& board,
                                       const target::BoardMark& mark, const BoardView& view) {
  for (const int k : {0, 1, board.columns}) {
    if (!view.seen[k]) return std::nullopt;
  }
  const lens::Vec2 first = view.corners_px[0];
  const lens::Vec2 along_row = (view.corners_px[1] - first) / board.square_m;
  const lens::Vec2 down_column = (view.corners_px[board.columns] - first) / board.square_m;
  const auto grey_at = [&](double x_m, double y_m) {
    return GreyAt(
        image, first + (mark.centre.x() + x_m) * along_row + (mark.centre.y() + y_m) * down_column);
  };
  const double around = 0.25 * (mark.size_m + board.square_m);  // between mark and edge
  double dark = 0, spot = 0;
  for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
    dark += 0.25 * grey_at(x * around, y * around);
    spot += 0.2 * grey_at(0.25 * mark.size_m * x, 0.25 * mark.size_m * y);
  }
  spot += 0.2 * grey_at(0, 0);
  const double white = 0.5 * (grey_at(board.square_m, 0) + grey_at(0, board.square_m));
  return (spot - dark) / std::max(1.0, white - dark);
}

/// The view in the order that the mark of the board shows, if it has one.
BoardView OrderedByMark(const image::LumaView& image, const target::Board& board, BoardView view) {
  const auto mark = target::MarkOf(board);
  if (!mark) return view;
  std::optional<BoardView> marked;
  for (const target::BoardTurn& turn : target::SymmetriesOf(board)) {
    BoardView turned = Turned(view, turn);
    const auto brightness = BrightnessOfMark(image, board, *mark, turned);
    if (!brightness) return view;
    if (*brightness < kUnmarked) continue;
    if (*brightness < kMarked || marked) return view;
    marked = std::move(turned);
  }
  return marked ? *marked : view;
}

}  // namespace

Result<BoardView> DetectBoard(const image::LumaView& image, const target::Board& board) {
  if (board.kind == target::BoardKind::kCharuco) return DetectCharuco(image, board);
  Result<BoardView> view =
      board.circles() ? DetectCircles(image, board) : DetectChessboard(image, board);
  if (!view) return view;
  return OrderedByMark(image, board, std::move(view.value()));
}

}  // namespace plumbline::vision
