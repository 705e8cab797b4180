#include "app/vision/print/board_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/vision/print/numbers.h"
#include "app/vision/print/sheet_frame.h"
#include "app/vision/print/tag_cells.h"

namespace plumbline::vision {
namespace {

constexpr double kMmPerMetre = 1e3;
constexpr double kMinBorder_mm = 4, kMaxBorder_mm = 7;
constexpr double kBoardRounding_mm = 1e-6;

double SquareMm(const target::Board& board) {
  return kMmPerMetre * board.square_m;
}
double MarkMm(const target::Board& board) {
  return kMmPerMetre * board.marker_m;
}

/// White border around the pattern [mm]: half a square, if that is neither too narrow to see the
/// outer edges nor a waste of paper.
double Border(const target::Board& board) {
  return std::clamp(0.5 * SquareMm(board), kMinBorder_mm, kMaxBorder_mm);
}

/// Distance from the first to the last point along the rows and down the columns [mm].
Vec2 PointSpan(const target::Board& board) {
  return 2 * kMmPerMetre * board.Centre();
}

/// Width and height of the printed pattern [mm].
Vec2 PatternSize(const target::Board& board) {
  return PointSpan(board) + Vec2::Constant(board.circles() ? MarkMm(board) : 2 * SquareMm(board));
}

/// Width and height of all that has to fit into the free area of a sheet [mm].
Vec2 RequiredSize(const target::Board& board) {
  return PatternSize(board) + Vec2::Constant(2 * Border(board)) + Vec2(0, kDimensionHeight_mm);
}

/// Whether the board fits, and in which orientation; the one of its own aspect is preferred.
/// @return  true for landscape
std::optional<bool> OrientationThatFits(const target::Board& board, const Paper& paper) {
  const Vec2 size = RequiredSize(board);
  const bool wide = size.x() > size.y();
  for (const bool landscape : {wide, !wide}) {
    const Vec2 area = FreeArea(paper.Size(landscape)).size;
    if (((area - size).array() >= -kBoardRounding_mm).all()) return landscape;
  }
  return std::nullopt;
}

/// Side of the largest square with which the board fits on a paper, rounded down to 0.1 mm.
double LargestSquare(const target::Board& board, const Paper& paper) {
  double fits_mm = 0, too_large_mm = SquareMm(board);
  while (too_large_mm - fits_mm > 1e-3) {
    const double middle_mm = 0.5 * (fits_mm + too_large_mm);
    target::Board scaled = board;
    scaled.square_m = middle_mm / kMmPerMetre;
    scaled.marker_m *= scaled.square_m / board.square_m;
    (OrientationThatFits(scaled, paper) ? fits_mm : too_large_mm) = middle_mm;
  }
  return std::floor(10 * fits_mm) / 10;
}

Error BoardTooLarge(const target::Board& board, const Paper& paper) {
  const Vec2 size = RequiredSize(board);
  std::string message = fmt::format(
      "this board takes {:.0f} x {:.0f} mm with its white border and does not fit on {}, which "
      "takes {} of up to {:.1f} mm",
      size.x(), size.y() - kDimensionHeight_mm, paper.name,
      board.circles() ? "a row spacing" : "squares", LargestSquare(board, paper));
  for (const Paper& other : Papers()) {
    if (!OrientationThatFits(board, other)) continue;
    return {message + fmt::format("; choose that, fewer points, or --page {}", other.name)};
  }
  return {message + "; choose that, or fewer points"};
}

/// @param first  the first point [mm]
void AddSquares(Sheet& sheet, const target::Board& board, const Vec2& first) {
  const double square = SquareMm(board);
  std::vector<bool> black;
  for (int row = 0; row <= board.rows; ++row) {
    for (int column = 0; column <= board.columns; ++column) {
      black.push_back((row + column) % 2 == 0);
    }
  }
  for (Outline& outline :
       CellOutlines(black, board.columns + 1, first - Vec2::Constant(square), square)) {
    sheet.outlines.push_back(std::move(outline));
  }
}

/// Adds the tags of a ChArUco board, numbered row by row over the white squares.
void AddBoardTags(Sheet& sheet, const target::Board& board, const Vec2& first) {
  const auto family = target::TagFamilyOfName(board.family).value();
  int id = 0;
  for (int row = 0; row <= board.rows; ++row) {
    for (int column = 0; column <= board.columns; ++column) {
      if ((row + column) % 2 == 0) continue;
      const Vec2 middle = first + SquareMm(board) * Vec2(column - 0.5, row - 0.5);
      AddTagCells(sheet, family, id++, middle, MarkMm(board));
    }
  }
}

void AddDiscs(Sheet& sheet, const target::Board& board, const Vec2& first) {
  for (int k = 0; k < board.corners(); ++k) {
    sheet.discs.push_back({first + kMmPerMetre * board.Corner(k), 0.5 * MarkMm(board)});
  }
}

/// Adds the mark that shows the order of the points: white, by the even-odd rule.
void AddMark(Sheet& sheet, const target::Board& board, const Vec2& first) {
  const auto mark = target::MarkOf(board);
  if (!mark) return;
  const Vec2 centre = first + kMmPerMetre * mark->centre;
  const double half = 0.5 * kMmPerMetre * mark->size_m;
  sheet.outlines.push_back({centre + Vec2(-half, -half), centre + Vec2(half, -half),
                            centre + Vec2(half, half), centre + Vec2(-half, half)});
}

std::string BoardTitle(const target::Board& board) {
  const std::string size = fmt::format("{} x {}", board.columns, board.rows);
  const double square = SquareMm(board), mark = MarkMm(board);
  switch (board.kind) {
    case target::BoardKind::kChessboard:
      return fmt::format("Chessboard, {} inner corners, squares of {:.6g} mm", size, square);
    case target::BoardKind::kCharuco:
      return fmt::format(
          "ChArUco board, {} inner corners, squares of {:.6g} mm, tags {} of {:.6g} mm", size,
          square, board.family, mark);
    case target::BoardKind::kCircles:
      return fmt::format("Circles, {}, {:.6g} mm apart, diameter {:.6g} mm", size, square, mark);
    case target::BoardKind::kAsymmetricCircles:
      return fmt::format("Asymmetric circles, {}, rows {:.6g} mm apart, diameter {:.6g} mm", size,
                         square, mark);
  }
  return {};
}

/// Adds the dimension line below the pattern, over which the scale is measured best.
void AddPatternDimension(Sheet& sheet, const target::Board& board, const Vec2& first,
                         double bottom) {
  const double square = SquareMm(board), span = PointSpan(board).x();
  if (board.circles()) {
    AddDimension(sheet, {first.x(), bottom}, span,
                 fmt::format("{:.6g} mm between the centres", span), span);
    return;
  }
  const double width = span + 2 * square;
  AddDimension(sheet, {first.x() - square, bottom}, width,
               fmt::format("{} squares of {:.6g} mm: {:.6g} mm", board.columns + 1, square, width),
               width);
}

}  // namespace

std::vector<std::string> BoardLines(const target::Board& board) {
  std::vector<std::string> lines = {"[board]", fmt::format("kind = \"{}\"", NameOf(board.kind)),
                                    fmt::format("columns = {}", board.columns),
                                    fmt::format("rows = {}", board.rows),
                                    "square_mm = " + TomlMm(SquareMm(board))};
  if (board.kind != target::BoardKind::kChessboard) {
    lines.push_back("mark_mm = " + TomlMm(MarkMm(board)));
  }
  if (board.kind == target::BoardKind::kCharuco) {
    lines.push_back(fmt::format("family = \"{}\"", board.family));
  }
  return lines;
}

Result<Document> BoardSheet(const target::Board& board, const Paper& paper) {
  const auto landscape = OrientationThatFits(board, paper);
  if (!landscape) return BoardTooLarge(board, paper);
  Document document{.title = BoardTitle(board), .size = paper.Size(*landscape), .sheets = {}};
  Sheet& sheet = document.sheets.emplace_back();
  const Rectangle area = FreeArea(document.size);
  const Vec2 pattern = PatternSize(board);
  const Vec2 corner = area.centre() - 0.5 * (pattern + Vec2(0, kDimensionHeight_mm));
  const Vec2 first =
      corner + Vec2::Constant(board.circles() ? 0.5 * MarkMm(board) : SquareMm(board));
  if (board.circles()) {
    AddDiscs(sheet, board, first);
  } else {
    AddSquares(sheet, board, first);
  }
  if (board.kind == target::BoardKind::kCharuco) AddBoardTags(sheet, board, first);
  AddMark(sheet, board, first);
  AddPatternDimension(sheet, board, first, corner.y() + pattern.y() + Border(board));
  AddUpArrow(sheet, {area.end().x() - 8, area.corner.y() - 3});
  AddFrame(
      sheet, document.size,
      {.title = document.title,
       .sheet_number = {},
       .notes = {board.circles()
                     ? "square_mm is the distance between rows, mark_mm the diameter of a circle."
                     : "For square_mm, measure the line below the board and divide by the squares.",
                 "Glue the sheet onto a stiff, flat plate: a bent board is refused."},
       .file = "plumbline.toml",
       .blocks = {BoardLines(board)}});
  return document;
}

}  // namespace plumbline::vision
