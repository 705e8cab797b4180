#include "app/vision/lens/board_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <queue>

#include "app/vision/lens/point_grid.h"

namespace plumbline::vision {
namespace {

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
      if (std::find(back.begin(), back.end(), static_cast<int>(k)) == back.end()) link = -1;
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

}  // namespace

int Lattice::found() const {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](int point) { return point >= 0; }));
}

std::vector<Lattice> FindLattices(const std::vector<SaddlePoint>& points) {
  const std::vector<Links> links = LinksOf(points);
  std::vector<bool> taken(points.size(), false);
  std::vector<Lattice> lattices;
  for (std::size_t seed = 0; seed < points.size(); ++seed) {
    if (taken[seed]) continue;
    const std::map<Place, int> numbered = NumberFrom(points, links, static_cast<int>(seed), taken);
    if (numbered.size() >= kMinCorners) lattices.push_back(PackLattice(numbered, points));
  }
  std::stable_sort(lattices.begin(), lattices.end(),
                   [](const Lattice& a, const Lattice& b) { return a.found() > b.found(); });
  return lattices;
}

}  // namespace plumbline::vision
