#include "app/vision/lens/circle_detection.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <queue>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/point_grid.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

// Detection of dark discs and their grouping into lattices.

/// A dark region with the moments of a filled ellipse.
struct Disc {
  lens::Vec2 at = lens::Vec2::Zero();                ///< centroid [px]
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  ///< second central moments [px^2]
  double area = 0;                                   ///< [px^2]

  /// Radius along the unit vector n of the ellipse with these moments [px].
  double RadiusAlong(const lens::Vec2& n) const {
    return 1 / std::sqrt(n.dot(spread.inverse() * n) / 4);
  }
};

/// Integer lattice coordinates. The axes are two of the lattice's shortest steps, with x cross y
/// pointing away from the viewer.
struct LatticePlace {
  int x = 0, y = 0;
  auto operator<=>(const LatticePlace&) const = default;  // NOLINT(modernize-use-nullptr)
};

constexpr double kMinDarkness = 3;  // grey levels below the mean of the surroundings
constexpr int kMinDiscArea_px = 16;
constexpr double kMaxExtent = 0.25;  // of a disc, share of the image width
// Tolerance of the area relative to that of the ellipse with the same moments (a square differs by
// 0.045); the second term, over the square root of the area, allows for the pixelated rim.
constexpr double kAreaTolerance = 0.025, kPerimeterTolerance_px = 0.6;
constexpr double kMaxFlat = 16;        // ratio of the moments: an axis ratio of 4
constexpr double kMaxAreaRatio = 2.2;  // ratio of the areas of neighbours
constexpr double kMaxOffPlace = 0.3;   // of the shorter step
constexpr std::size_t kNearest = 8;    // neighbours considered for the first steps
constexpr double kMinSine = 0.5;       // between the two first steps
constexpr std::size_t kMinDiscs = 7;

/// Sums over the pixels of one region.
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

std::optional<Disc> DiscOf(const Moments& m, double longest) {
  if (m.n < kMinDiscArea_px) return std::nullopt;
  Disc disc;
  disc.area = m.n;
  disc.at = {m.x / m.n, m.y / m.n};
  disc.spread << m.xx / m.n - disc.at.x() * disc.at.x(), m.xy / m.n - disc.at.x() * disc.at.y(),
      m.xy / m.n - disc.at.x() * disc.at.y(), m.yy / m.n - disc.at.y() * disc.at.y();
  disc.spread.diagonal().array() += 1.0 / 12;  // second moment of a pixel's square
  const double det = disc.spread.determinant(), trace = disc.spread.trace();
  // The eigenvalues' ratio q gives trace^2 / det = q + 2 + 1 / q.
  if (!(det > 0) || trace * trace > (kMaxFlat + 2 + 1 / kMaxFlat) * det) return std::nullopt;
  if (4 * std::sqrt(trace) > longest) return std::nullopt;
  const double ellipse = 4 * std::numbers::pi * std::sqrt(det);
  if (std::abs(disc.area / ellipse - 1) >
      kAreaTolerance + kPerimeterTolerance_px / std::sqrt(disc.area))
    return std::nullopt;
  return disc;
}

/// Grid of the discs, with cells of about one disc each.
PointGrid GridOf(const std::vector<Disc>& discs) {
  std::vector<lens::Vec2> centres;
  lens::Vec2 extent = lens::Vec2::Ones();
  for (const Disc& disc : discs) {
    centres.push_back(disc.at);
    extent = extent.cwiseMax(disc.at);
  }
  const double each = extent.x() * extent.y() / static_cast<double>(discs.size() + 1);
  return {std::move(centres), std::max(4.0, std::sqrt(each))};
}

bool SimilarSize(const Disc& a, const Disc& b) {
  return std::max(a.area, b.area) < kMaxAreaRatio * std::min(a.area, b.area);
}

double Cross(const lens::Vec2& a, const lens::Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

struct Axes {
  lens::Vec2 x, y;
};

/// The two shortest non-parallel steps from a disc, which span the lattice.
std::optional<Axes> AxesAt(const std::vector<Disc>& discs, const PointGrid& grid, int seed) {
  std::optional<lens::Vec2> first;
  for (const int other : grid.Nearest(seed, kNearest, {2, 4, 8, 16})) {
    if (!SimilarSize(discs[seed], discs[other])) continue;
    const lens::Vec2 step = discs[other].at - discs[seed].at;
    if (!first) {
      first = step;
    } else if (std::abs(Cross(*first, step)) > kMinSine * first->norm() * step.norm()) {
      return Cross(*first, step) > 0 ? Axes{*first, step} : Axes{step, *first};
    }
  }
  return std::nullopt;
}

std::map<LatticePlace, int> NumberDiscsFrom(const std::vector<Disc>& discs, const PointGrid& grid,
                                            int seed, const Axes& axes, std::vector<bool>& taken) {
  struct Step {
    int disc;
    LatticePlace place;
    Axes axes;
  };
  std::map<LatticePlace, int> lattice;
  std::queue<Step> open;
  open.push({seed, {0, 0}, axes});
  taken[seed] = true;
  while (!open.empty()) {
    const Step step = open.front();
    open.pop();
    if (!lattice.emplace(step.place, step.disc).second) continue;
    const double within = kMaxOffPlace * std::min(step.axes.x.norm(), step.axes.y.norm());
    for (const auto& [dx, dy] :
         {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}) {
      const lens::Vec2 direction = dx * step.axes.x + dy * step.axes.y;
      const int next = grid.At(discs[step.disc].at + direction, within);
      if (next < 0 || taken[next] || !SimilarSize(discs[step.disc], discs[next])) continue;
      Axes onward = step.axes;
      const lens::Vec2 stepped = discs[next].at - discs[step.disc].at;
      if (dy == 0) onward.x = dx * stepped;
      if (dx == 0) onward.y = dy * stepped;
      taken[next] = true;
      open.push({next, {step.place.x + dx, step.place.y + dy}, onward});
    }
  }
  return lattice;
}

/// Regions darker than the local mean whose area equals that of the ellipse with their moments,
/// 4 pi sqrt(det spread). Largest first.
/// @param smooth  CV_8U
/// @param around  side of the square over which the mean is taken [px]
/// @param most    maximum number of discs
std::vector<Disc> FindDiscs(const cv::Mat& smooth, int around, std::size_t most) {
  cv::Mat mean, dark, labels;
  cv::blur(smooth, mean, {around, around}, {-1, -1}, cv::BORDER_REFLECT);
  cv::subtract(mean, smooth, dark);  // saturates at zero
  cv::threshold(dark, dark, kMinDarkness, 255, cv::THRESH_BINARY);
  const int count = cv::connectedComponents(dark, labels, 4, CV_32S);
  std::vector<Moments> moments(static_cast<std::size_t>(count));
  for (int v = 0; v < labels.rows; ++v) {
    const int* label = labels.ptr<int>(v);
    for (int u = 0; u < labels.cols; ++u) {
      if (label[u] == 0) continue;
      Moments& m = moments[label[u]];
      m.n += 1;
      m.x += u;
      m.y += v;
      m.xx += static_cast<double>(u) * u;
      m.xy += static_cast<double>(u) * v;
      m.yy += static_cast<double>(v) * v;
    }
  }
  std::vector<Disc> discs;
  for (const Moments& m : moments) {
    if (const auto disc = DiscOf(m, kMaxExtent * smooth.cols)) discs.push_back(*disc);
  }
  std::ranges::stable_sort(discs, [](const Disc& a, const Disc& b) { return a.area > b.area; });
  if (discs.size() > most) discs.resize(most);
  return discs;
}

/// Connected lattices, largest first, as disc indices by place. A lattice grows from disc to disc
/// while its steps and the discs' sizes change little.
std::vector<std::map<LatticePlace, int>> FindDiscLattices(const std::vector<Disc>& discs) {
  const PointGrid grid = GridOf(discs);
  std::vector<bool> taken(discs.size(), false);
  std::vector<std::map<LatticePlace, int>> lattices;
  for (std::size_t seed = 0; seed < discs.size(); ++seed) {
    if (taken[seed]) continue;
    const auto axes = AxesAt(discs, grid, static_cast<int>(seed));
    if (!axes) continue;
    auto lattice = NumberDiscsFrom(discs, grid, static_cast<int>(seed), *axes, taken);
    if (lattice.size() >= kMinDiscs) lattices.push_back(std::move(lattice));
  }
  std::ranges::stable_sort(lattices,
                           [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return lattices;
}

// Sub-pixel refinement of disc centres.

constexpr double kDiscSmooth_px = 1;
constexpr double kRimStart = 0.55;  // of the radius: where the rim zone starts
constexpr double kRimEnd_px = 5;    // beyond the radius, where it ends at the latest
constexpr double kMinRadius_px = 3;
constexpr double kMaxShift = 0.3;  // of the radius: largest correction

struct Centre {
  lens::Vec2 at;
  double width_px;  ///< of the edge, standard deviation, smoothing included
};

/// @param at  of the disc, in `smooth`
std::optional<Centre> RefinedDisc(const cv::Mat& smooth, const Disc& disc, const lens::Vec2& at,
                                  double gap_px) {
  const double longest =
      std::max(disc.RadiusAlong(lens::Vec2::UnitX()), disc.RadiusAlong(lens::Vec2::UnitY()));
  if (longest < kMinRadius_px) return std::nullopt;
  const double radius = 2 * std::sqrt(disc.spread.trace());  // an upper bound of the longer radius
  const double beyond = std::min(kRimEnd_px, 0.5 * gap_px);
  const int reach = static_cast<int>(std::ceil(radius + beyond));
  const int u0 = static_cast<int>(std::lround(at.x())), v0 = static_cast<int>(std::lround(at.y()));
  if (u0 <= reach || v0 <= reach || u0 + reach + 1 >= smooth.cols || v0 + reach + 1 >= smooth.rows)
    return std::nullopt;
  const Eigen::Matrix2d shape = disc.spread.inverse() / 4;  // q^T shape q = 1 on the rim
  Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> right = Eigen::Matrix<double, 5, 1>::Zero();
  double darkest = 1e9, brightest = -1e9, steepest = 0;
  for (int j = -reach; j <= reach; ++j) {
    const float* above = smooth.ptr<float>(v0 + j - 1) + u0;
    const float* here = smooth.ptr<float>(v0 + j) + u0;
    const float* below = smooth.ptr<float>(v0 + j + 1) + u0;
    for (int i = -reach; i <= reach; ++i) {
      const lens::Vec2 q = lens::Vec2(u0 + i, v0 + j) - at;
      const double share = std::sqrt(q.dot(shape * q));  // 1 on the rim
      if (share < kRimStart || (share - 1) * q.norm() > beyond * share) continue;
      lens::Vec2 n(0.5 * (here[i + 1] - here[i - 1]), 0.5 * (below[i] - above[i]));
      const double g = n.norm();
      darkest = std::min(darkest, static_cast<double>(here[i]));
      brightest = std::max(brightest, static_cast<double>(here[i]));
      steepest = std::max(steepest, g);
      if (!(g > 0)) continue;
      n /= g;
      const double d = n.dot(q) / radius;
      Eigen::Matrix<double, 5, 1> row;
      row << n.x() * n.x(), n.x() * n.y(), n.y() * n.y(), -n.x() * d, -n.y() * d;
      normal += g * g * row * row.transpose();
      right -= g * g * d * d * row;
    }
  }
  const Eigen::LDLT<Eigen::Matrix<double, 5, 5>> solver(normal);
  const Eigen::Matrix<double, 5, 1> conic = solver.solve(right);
  const lens::Vec2 moved = 0.5 * radius * conic.tail<2>();
  if (!moved.allFinite() || !(moved.norm() < kMaxShift * longest)) return std::nullopt;
  return Centre{at + moved, (brightest - darkest) / std::max(2.5066 * steepest, 1e-6)};
}

/// Fits an ellipse to the rim of each disc. A rim pixel q whose gradient has unit direction n and
/// magnitude g defines the tangent n . q = d; the tangents l = (n, -d) of an ellipse satisfy
///   l^T C l = 0,   C the dual conic,
/// which is solved by least squares over the rim with weights g^2
/// [J.-N. Ouellet and P. Hebert, Precise ellipse estimation without contour point extraction,
/// Machine Vision and Applications 21 (2009)]. The centre is (C13, C23) / C33; symmetric blur and
/// shading do not move it. The image is smoothed by a Gaussian of 1 px first.
/// @param discs   in full-resolution pixels, one per point; ignored where `seen` is false
/// @param gap_px  distance to the nearest rim of another disc
/// @param view    on input, corners_px and seen; corners_px is refined, `seen` is cleared where the
///                fit fails, and blur_px is set
void RefineDiscs(const image::LumaView& image, const std::vector<Disc>& discs, double gap_px,
                 BoardView& view) {
  const cv::Mat whole(image.height, image.width, CV_8U, const_cast<std::uint8_t*>(image.data),
                      static_cast<std::size_t>(image.stride));
  cv::Mat grey, smooth;
  whole.convertTo(grey, CV_32F);
  cv::GaussianBlur(grey, smooth, {0, 0}, kDiscSmooth_px, kDiscSmooth_px, cv::BORDER_REPLICATE);
  std::vector<double> widths;
  for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
    if (!view.seen[k]) continue;
    const auto centre = RefinedDisc(smooth, discs[k], view.corners_px[k], gap_px);
    view.seen[k] = centre.has_value();
    if (!centre) continue;
    view.corners_px[k] = centre->at;
    widths.push_back(centre->width_px);
  }
  if (widths.empty()) return;
  const double width_px = statistics::MedianOf(widths);
  view.blur_px = std::sqrt(std::max(0.0, width_px * width_px - kDiscSmooth_px * kDiscSmooth_px));
}

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
