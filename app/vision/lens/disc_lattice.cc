#include "app/vision/lens/disc_lattice.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <queue>

#include "app/vision/lens/point_grid.h"

namespace plumbline::vision {
namespace {

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

}  // namespace

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
  std::stable_sort(discs.begin(), discs.end(),
                   [](const Disc& a, const Disc& b) { return a.area > b.area; });
  if (discs.size() > most) discs.resize(most);
  return discs;
}

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
  std::stable_sort(lattices.begin(), lattices.end(),
                   [](const auto& a, const auto& b) { return a.size() > b.size(); });
  return lattices;
}

}  // namespace plumbline::vision
