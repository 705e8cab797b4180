#include "app/lens/board_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <queue>

namespace plumbline {
namespace {

constexpr double kAside = 0.3;        // tangent of the angle that a neighbour may lie off the edge
constexpr double kEdgesAgree = 0.35;  // [rad] between the edges of neighbours
constexpr std::size_t kLooked = 12;   // nearest points that may be neighbours
constexpr int kLeastCorners = 9;

double AngleBetween(double a, double b) {
  const double difference = std::fmod(std::abs(a - b), std::numbers::pi);
  return std::min(difference, std::numbers::pi - difference);
}

/// Points sorted into square cells, for the nearest ones.
class Cells {
 public:
  Cells(const std::vector<SaddlePoint>& points, double size) : points_(points), size_(size) {
    for (std::size_t k = 0; k < points.size(); ++k)
      cells_[Key(points[k].at)].push_back(static_cast<int>(k));
  }
  std::vector<int> Nearest(int of) const {
    const auto [x, y] = Key(points_[of].at);
    std::vector<std::pair<double, int>> near;
    for (int reach = 1; reach <= 4 && near.size() < kLooked; ++reach) {
      near.clear();
      for (int i = -reach; i <= reach; ++i) {
        for (int j = -reach; j <= reach; ++j) {
          const auto cell = cells_.find({x + i, y + j});
          if (cell == cells_.end()) continue;
          for (const int k : cell->second) {
            if (k != of) near.emplace_back((points_[k].at - points_[of].at).norm(), k);
          }
        }
      }
    }
    const std::size_t count = std::min(kLooked, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
    std::vector<int> nearest;
    for (std::size_t k = 0; k < count; ++k) nearest.push_back(near[k].second);
    return nearest;
  }

 private:
  std::pair<int, int> Key(const Vec2& at) const {
    return {static_cast<int>(at.x() / size_), static_cast<int>(at.y() / size_)};
  }
  const std::vector<SaddlePoint>& points_;
  double size_;
  std::map<std::pair<int, int>, std::vector<int>> cells_;
};

/// The four ways from a corner: along edge [0], along edge [1], and back.
using Links = std::array<int, 4>;

Vec2 Way(const SaddlePoint& point, int way) {
  const double angle = point.edge_rad[way % 2];
  return (way < 2 ? 1 : -1) * Vec2(std::cos(angle), std::sin(angle));
}

/// Which way of `from` leads to `to`, or -1. Along an edge the colours swap sides, so what is edge
/// [0] of one is edge [1] of its neighbour.
int WayTo(const SaddlePoint& from, const SaddlePoint& to) {
  const Vec2 step = to.at - from.at;
  for (int way = 0; way < 4; ++way) {
    const Vec2 along = Way(from, way);
    const double ahead = along.dot(step);
    const double aside = std::abs(along.x() * step.y() - along.y() * step.x());
    if (ahead <= 0 || aside > kAside * ahead) continue;
    if (AngleBetween(from.edge_rad[way % 2], to.edge_rad[1 - way % 2]) > kEdgesAgree) continue;
    if (AngleBetween(from.edge_rad[1 - way % 2], to.edge_rad[way % 2]) > kEdgesAgree) continue;
    return way;
  }
  return -1;
}

std::vector<Links> LinksOf(const std::vector<SaddlePoint>& points) {
  double extent = 1;
  for (const SaddlePoint& point : points) extent = std::max(extent, point.at.maxCoeff());
  const double size = std::max(8.0, extent / std::sqrt(static_cast<double>(points.size()) + 1));
  const Cells cells(points, size);
  std::vector<Links> nearest(points.size(), Links{-1, -1, -1, -1});
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (const int other : cells.Nearest(static_cast<int>(k))) {
      const int way = WayTo(points[k], points[other]);
      if (way >= 0 && nearest[k][way] < 0) nearest[k][way] = other;
    }
  }
  // Only what both sides see is a link.
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

/// Numbers everything that hangs on `seed`. At each corner the two axes of the board are known from
/// the corner it was reached from.
std::map<Place, int> Numbered(const std::vector<SaddlePoint>& points,
                              const std::vector<Links>& links, int seed, std::vector<bool>& taken) {
  struct Step {
    int point;
    Place place;
    Vec2 x, y;  ///< the board's axes here, unit vectors in the image
  };
  std::map<Place, int> lattice;
  std::queue<Step> open;
  const Vec2 x0 = Way(points[seed], 0), y0 = Way(points[seed], 1);
  open.push({seed, {0, 0}, x0, y0});
  taken[seed] = true;
  while (!open.empty()) {
    const Step step = open.front();
    open.pop();
    if (!lattice.emplace(step.place, step.point).second) continue;
    for (int way = 0; way < 4; ++way) {
      const int next = links[step.point][way];
      if (next < 0 || taken[next]) continue;
      const Vec2 along = Way(points[step.point], way);
      const double on_x = along.dot(step.x), on_y = along.dot(step.y);
      Place place = step.place;
      if (std::abs(on_x) > std::abs(on_y)) {
        place.column += on_x > 0 ? 1 : -1;
      } else {
        place.row += on_y > 0 ? 1 : -1;
      }
      // The neighbour's axes are those of its own ways that point along ours.
      Step onward{next, place, Vec2::Zero(), Vec2::Zero()};
      double best_x = -2, best_y = -2;
      for (int its = 0; its < 4; ++its) {
        const Vec2 direction = Way(points[next], its);
        if (direction.dot(step.x) > best_x) {
          best_x = direction.dot(step.x);
          onward.x = direction;
        }
        if (direction.dot(step.y) > best_y) {
          best_y = direction.dot(step.y);
          onward.y = direction;
        }
      }
      taken[next] = true;
      open.push(onward);
    }
  }
  return lattice;
}

Lattice Packed(const std::map<Place, int>& numbered, const std::vector<SaddlePoint>& points) {
  Place least{1 << 20, 1 << 20}, most{-(1 << 20), -(1 << 20)};
  for (const auto& [place, point] : numbered) {
    least = {std::min(least.column, place.column), std::min(least.row, place.row)};
    most = {std::max(most.column, place.column), std::max(most.row, place.row)};
  }
  Lattice lattice;
  lattice.columns = most.column - least.column + 1;
  lattice.rows = most.row - least.row + 1;
  lattice.points.assign(static_cast<std::size_t>(lattice.columns) * lattice.rows, -1);
  Vec2 x = Vec2::Zero(), y = Vec2::Zero();
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
    const std::map<Place, int> numbered = Numbered(points, links, static_cast<int>(seed), taken);
    if (numbered.size() >= kLeastCorners) lattices.push_back(Packed(numbered, points));
  }
  std::stable_sort(lattices.begin(), lattices.end(),
                   [](const Lattice& a, const Lattice& b) { return a.found() > b.found(); });
  return lattices;
}

}  // namespace plumbline
