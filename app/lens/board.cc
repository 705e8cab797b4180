#include "app/lens/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/tracking/tag_family.h"

namespace plumbline {
namespace {

constexpr std::pair<BoardKind, std::string_view> kKinds[] = {
    {BoardKind::kChessboard, "chessboard"},
    {BoardKind::kCharuco, "charuco"},
    {BoardKind::kCircles, "circles"},
    {BoardKind::kAsymmetricCircles, "acircles"},
};
constexpr int kLeastPoints = 3, kMostPoints = 100;
constexpr double kLeastTag = 0.2, kLargestTag = 0.92;     // share of a square
constexpr double kLeastDisc = 0.15, kLargestDisc = 0.85;  // share of the nearest neighbour's step

std::string WhyNoCharuco(const Board& board) {
  const auto family = TagFamilyOfName(board.family);
  if (!family) return "--family: " + family.error();
  if (!(board.mark_m >= kLeastTag * board.square_m && board.mark_m <= kLargestTag * board.square_m))
    return fmt::format(
        "--mark-mm: a ChArUco board needs the side of its tags, black border included: {:g} to "
        "{:g} mm where its squares have {:g} mm",
        1e3 * kLeastTag * board.square_m, 1e3 * kLargestTag * board.square_m, 1e3 * board.square_m);
  const int tags = ((board.columns + 1) * (board.rows + 1) + 1) / 2;
  const int codes = static_cast<int>(family->codes.size());
  if (tags > codes) {
    return fmt::format("--family: {} has {} tags and a board of {} x {} inner corners up to {}",
                       board.family, codes, board.columns, board.rows, tags);
  }
  return {};
}

std::string WhyNoCircles(const Board& board) {
  // The nearest neighbour of an asymmetric grid lies diagonally.
  const double step = board.square_m * (board.kind == BoardKind::kCircles ? 1 : std::sqrt(2.0));
  if (board.mark_m >= kLeastDisc * step && board.mark_m <= kLargestDisc * step) return {};
  return fmt::format(
      "--mark-mm: a board of circles needs their diameter: {:.3g} to {:.3g} mm where its rows lie "
      "{:g} mm apart",
      1e3 * kLeastDisc * step, 1e3 * kLargestDisc * step, 1e3 * board.square_m);
}

}  // namespace

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

std::string WhyNoBoard(const Board& board) {
  const auto [fewest, most] = std::minmax(board.columns, board.rows);
  if (fewest < kLeastPoints || most > kMostPoints)
    return fmt::format("--board: {} x {} points; {} to {} each are possible", board.columns,
                       board.rows, kLeastPoints, kMostPoints);
  if (!(board.square_m > 0)) return "--square-mm: must be positive";
  if (board.kind == BoardKind::kCharuco) return WhyNoCharuco(board);
  if (board.circles()) return WhyNoCircles(board);
  return {};
}

}  // namespace plumbline
