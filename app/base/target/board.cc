#include "app/base/target/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "app/base/target/tag_family.h"

namespace plumbline::target {
namespace {

constexpr std::pair<BoardKind, std::string_view> kKinds[] = {
    {BoardKind::kChessboard, "chessboard"},
    {BoardKind::kCharuco, "charuco"},
    {BoardKind::kCircles, "circles"},
    {BoardKind::kAsymmetricCircles, "acircles"},
};
constexpr int kMinPoints = 3, kMaxPoints = 100;
constexpr double kMinTag = 0.2, kMaxTag = 0.92;  // share of a square
constexpr double kMinDisc = 0.15,
                 kMaxDisc = 0.85;  // share of the distance to the nearest neighbour

std::optional<BoardFault> FaultOfCharuco(const Board& board) {
  const auto family = TagFamilyOfName(board.family);
  if (!family) return BoardFault{"family", family.error()};
  if (!(board.marker_m >= kMinTag * board.square_m && board.marker_m <= kMaxTag * board.square_m)) {
    return BoardFault{"mark_mm",
                      fmt::format("a ChArUco board needs the side of its tags, black border "
                                  "included: {:g} to {:g} mm for squares of {:g} mm",
                                  1e3 * kMinTag * board.square_m, 1e3 * kMaxTag * board.square_m,
                                  1e3 * board.square_m)};
  }
  const int tags = ((board.columns + 1) * (board.rows + 1) + 1) / 2;
  const int codes = static_cast<int>(family->codes.size());
  if (tags > codes) {
    return BoardFault{
        "family",
        fmt::format("{} has only {} tags, but a board of {} x {} inner corners needs up to {}",
                    board.family, codes, board.columns, board.rows, tags)};
  }
  return std::nullopt;
}

std::optional<BoardFault> FaultOfCircles(const Board& board) {
  // The nearest neighbour of an asymmetric grid lies diagonally.
  const double step = board.square_m * (board.kind == BoardKind::kCircles ? 1 : std::sqrt(2.0));
  if (board.marker_m >= kMinDisc * step && board.marker_m <= kMaxDisc * step) return std::nullopt;
  return BoardFault{
      "mark_mm",
      fmt::format(
          "a board of circles needs their diameter: {:.3g} to {:.3g} mm for rows {:g} mm apart",
          1e3 * kMinDisc * step, 1e3 * kMaxDisc * step, 1e3 * board.square_m)};
}

}  // namespace

std::vector<BoardTurn> SymmetriesOf(const Board& board) {
  std::map<std::pair<int, int>, int> point_at;  // in half steps from the centre
  const int width =
      board.kind == BoardKind::kAsymmetricCircles ? 2 * board.columns - 1 : board.columns - 1;
  const auto place = [&](int k) {
    return std::pair(2 * board.StepsRight(k) - width, 2 * board.StepsDown(k) - (board.rows - 1));
  };
  for (int k = 0; k < board.corners(); ++k) point_at.emplace(place(k), k);
  std::vector<BoardTurn> turns;
  for (int quarters = 0; quarters < 4; ++quarters) {
    if (quarters > 0 && board.kind == BoardKind::kCharuco) break;
    BoardTurn turn{quarters, {}};
    for (int k = 0; k < board.corners(); ++k) {
      auto [x, y] = place(k);
      for (int q = 0; q < quarters; ++q) std::tie(x, y) = std::pair(-y, x);
      const auto found = point_at.find({x, y});
      if (found == point_at.end()) break;
      turn.points.push_back(found->second);
    }
    if (turn.points.size() != point_at.size()) continue;
    // A quarter turn, and each step along a row or column, swap the colours of a chessboard.
    const int first = turn.points.front();
    const bool recoloured = (quarters + board.StepsRight(first) + board.StepsDown(first)) % 2 != 0;
    if (recoloured && board.kind == BoardKind::kChessboard) continue;
    turns.push_back(std::move(turn));
  }
  return turns;
}

std::optional<BoardMark> MarkOf(const Board& board) {
  constexpr double kShare = 0.4;  // of the square
  if (board.kind != BoardKind::kChessboard) return std::nullopt;
  return BoardMark{lens::Vec2::Constant(-0.5 * board.square_m), kShare * board.square_m};
}

std::optional<BoardKind> BoardKindOfName(std::string_view name) {
  const auto* const found = std::find_if(std::begin(kKinds), std::end(kKinds),
                                         [&](const auto& kind) { return kind.second == name; });
  if (found == std::end(kKinds)) return std::nullopt;
  return found->first;
}

std::string_view NameOf(BoardKind kind) {
  return std::find_if(std::begin(kKinds), std::end(kKinds),
                      [&](const auto& one) { return one.first == kind; })
      ->second;
}

std::string WordsOf(const Board& board) {
  std::string words = fmt::format("{} {}x{}, {:g} mm", NameOf(board.kind), board.columns,
                                  board.rows, 1e3 * board.square_m);
  if (board.kind != BoardKind::kChessboard)
    words += fmt::format(", mark {:g} mm", 1e3 * board.marker_m);
  if (board.kind == BoardKind::kCharuco) words += ", " + board.family;
  return words;
}

std::optional<BoardFault> FaultOf(const Board& board) {
  const auto [fewest, most] = std::minmax(board.columns, board.rows);
  if (fewest < kMinPoints || most > kMaxPoints) {
    return BoardFault{
        "columns",
        fmt::format("{} x {} points; a board must have {} to {} points in each direction",
                    board.columns, board.rows, kMinPoints, kMaxPoints)};
  }
  if (!(board.square_m > 0 && std::isfinite(board.square_m))) {
    return BoardFault{"square_mm", "must be positive"};
  }
  if (board.kind == BoardKind::kCharuco) return FaultOfCharuco(board);
  if (board.circles()) return FaultOfCircles(board);
  return std::nullopt;
}

}  // namespace plumbline::target
