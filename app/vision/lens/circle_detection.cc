#include "app/vision/lens/circle_detection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "app/vision/lens/disc_refinement.h"

namespace plumbline::vision {
namespace {

constexpr int kCircleWidth_px = 960;
constexpr double kCircleSmooth_px = 1;
constexpr int kBackgroundDivisors[] = {
    8, 24, 4};  // image width / width of the background window, tried in turn
constexpr std::size_t kMaxDiscs = 2000;
constexpr double kMinDiscsSeen = 0.85;    // share of the discs for a board to count as complete
constexpr double kMaxDiscsBeside = 0.08;  // share of extra discs that may be linked to its border
constexpr int kMaxAxisStep = 2;           // of the grid's axes in lattice steps, and vice versa

using DiscMap = std::map<LatticePlace, int>;
using Turn = Eigen::Matrix2i;

/// All integer matrices that may map the lattice's two shortest steps to steps of the grid. Their
/// determinant is the number of grid positions per disc: 1, or 2 on an asymmetric grid.
std::vector<Turn> TurnsOf(const target::Board& board) {
  const int discs_apart = board.kind == target::BoardKind::kAsymmetricCircles ? 2 : 1;
  std::vector<Turn> turns;
  const int m = kMaxAxisStep;
  for (int a = -m; a <= m; ++a) {
    for (int b = -m; b <= m; ++b) {
      for (int c = -m; c <= m; ++c) {
        for (int d = -m; d <= m; ++d) {
          if (a * d - b * c != discs_apart) continue;
          turns.emplace_back();
          turns.back() << a, b, c, d;
        }
      }
    }
  }
  return turns;
}

struct Match {
  int found = 0;
  double first_px = 0;     ///< u + v of the first half of the points minus that of the others
  std::vector<int> discs;  ///< of each point, or -1
};

/// The placement of the board's pattern on a rotated lattice that covers most discs.
Match BestPlacement(const DiscMap& lattice, const Turn& turn, const target::Board& board,
                    const std::vector<Disc>& discs) {
  DiscMap turned;
  LatticePlace least{1 << 20, 1 << 20}, most{-(1 << 20), -(1 << 20)};
  for (const auto& [place, disc] : lattice) {
    const LatticePlace to{turn(0, 0) * place.x + turn(0, 1) * place.y,
                          turn(1, 0) * place.x + turn(1, 1) * place.y};
    turned.emplace(to, disc);
    least = {std::min(least.x, to.x), std::min(least.y, to.y)};
    most = {std::max(most.x, to.x), std::max(most.y, to.y)};
  }
  Match best;
  const int right = static_cast<int>(std::lround(2 * board.Centre().x() / board.square_m));
  const int down = board.rows - 1;
  // Each extra disc linked to the border may extend the lattice by two steps.
  const int beyond = most.x - least.x - right + most.y - least.y - down;
  if (beyond > 2 * kMaxDiscsBeside * board.corners()) return best;
  for (int y = least.y; y + down <= most.y; ++y) {
    for (int x = least.x; x + right <= most.x; ++x) {
      Match match;
      for (int k = 0; k < board.corners(); ++k) {
        const auto found = turned.find({x + board.StepsRight(k), y + board.StepsDown(k)});
        match.discs.push_back(found == turned.end() ? -1 : found->second);
        if (found == turned.end()) continue;
        ++match.found;
        match.first_px += (2 * k < board.corners() ? 1 : -1) * discs[found->second].at.sum();
      }
      if (match.found > best.found) best = std::move(match);
    }
  }
  return best;
}

/// The board within a lattice, upright; nullopt if it is not nearly complete or too many other
/// discs are linked to it.
std::optional<Match> DiscsWithin(const DiscMap& lattice, const target::Board& board,
                                 const std::vector<Disc>& discs) {
  const int least = static_cast<int>(std::ceil(kMinDiscsSeen * board.corners()));
  const int size = static_cast<int>(lattice.size());
  if (size < least || size > (1 + kMaxDiscsBeside) * board.corners()) return std::nullopt;
  Match best;
  for (const Turn& turn : TurnsOf(board)) {
    Match match = BestPlacement(lattice, turn, board, discs);
    if (match.found > best.found || (match.found == best.found && match.first_px < best.first_px))
      best = std::move(match);
  }
  if (best.found < least || size - best.found > kMaxDiscsBeside * board.corners())
    return std::nullopt;
  return best;
}

/// Smallest distance between the rims of two of the board's discs [px].
double GapOf(const Match& match, const std::vector<Disc>& discs) {
  double gap = 1e9;
  for (const int a : match.discs) {
    for (const int b : match.discs) {
      if (a < 0 || b <= a) continue;
      const lens::Vec2 between = discs[b].at - discs[a].at;
      const lens::Vec2 n = between.normalized();
      gap = std::min(gap, between.norm() - discs[a].RadiusAlong(n) - discs[b].RadiusAlong(n));
    }
  }
  return std::max(gap, 1.0);
}

}  // namespace

Result<BoardView> DetectCircles(const image::LumaView& image, const target::Board& board) {
  const int factor = std::max(1, (image.width + kCircleWidth_px / 2) / kCircleWidth_px);
  const int width = image.width / factor, height = image.height / factor;
  if (std::min(width, height) < 2 * kBackgroundDivisors[1])
    return Error{fmt::format("the image is only {} x {} px", image.width, image.height)};
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  cv::Mat small, smooth;
  cv::resize(whole(cv::Rect(0, 0, width * factor, height * factor)), small, {width, height}, 0, 0,
             cv::INTER_AREA);
  cv::GaussianBlur(small, smooth, {0, 0}, kCircleSmooth_px, kCircleSmooth_px, cv::BORDER_REPLICATE);
  std::size_t largest = 0;
  for (const int around : kBackgroundDivisors) {
    std::vector<Disc> discs = FindDiscs(smooth, width / around | 1, kMaxDiscs);
    for (const DiscMap& lattice : FindDiscLattices(discs)) {
      largest = std::max(largest, lattice.size());
      const auto match = DiscsWithin(lattice, board, discs);
      if (!match) continue;
      const double gap_px = factor * GapOf(*match, discs);
      BoardView view;
      std::vector<Disc> of_points;
      for (const int disc : match->discs) {
        view.seen.push_back(disc >= 0);
        of_points.push_back(disc >= 0 ? discs[disc] : Disc{});
        Disc& point = of_points.back();
        point.at = factor * point.at + lens::Vec2::Constant(0.5 * (factor - 1));
        point.spread *= factor * factor;
        view.corners_px.push_back(disc >= 0 ? point.at : lens::Vec2::Zero());
      }
      RefineDiscs(image, of_points, gap_px, view);
      return view;
    }
  }
  const auto points = static_cast<std::size_t>(board.corners());
  if (largest < points / 4) return Error{"no grid of circles"};
  if (largest > points) {
    return Error{
        fmt::format("a grid of {} circles instead of {} ({} x {}): check --board and "
                    "--board-kind",
                    largest, points, board.columns, board.rows)};
  }
  if (largest == points) {
    return Error{
        fmt::format("a grid of {} circles, but not in {} rows of {}: check --board and "
                    "--board-kind",
                    largest, board.rows, board.columns)};
  }
  return Error{
      fmt::format("only a part of the board, or another one: {} of {} circles", largest, points)};
}

}  // namespace plumbline::vision
