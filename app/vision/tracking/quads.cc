#include "app/vision/tracking/quads.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace plumbline::vision {
namespace {

constexpr double kMinShareOfHull = 0.82;  // of the hull's area in the quadrilateral
constexpr double kMinSide_px = 4;         // of the search image
constexpr std::size_t kMaxHullPoints = 400;

double Cross(const lens::Vec2& a, const lens::Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Twice the area of a triangle, positive if a, b, c run clockwise as seen (v downwards).
double Area2(const lens::Vec2& a, const lens::Vec2& b, const lens::Vec2& c) {
  return Cross(b - a, c - a);
}

/// std::find for bytes; memchr() compares many at once.
const std::uint8_t* FirstOf(const std::uint8_t* from, const std::uint8_t* end, int value) {
  const void* const found = std::memchr(from, value, static_cast<std::size_t>(end - from));
  return found != nullptr ? static_cast<const std::uint8_t*>(found) : end;
}

/// Adds a point to a hull chain that turns clockwise (sign 1) or counter-clockwise (-1).
void AddToChain(std::vector<lens::Vec2>& chain, const lens::Vec2& point, double sign) {
  while (chain.size() >= 2 && sign * Area2(chain[chain.size() - 2], chain.back(), point) <= 0) {
    chain.pop_back();
  }
  chain.push_back(point);
}

}  // namespace

bool AreAlike(const Corners& a, const Corners& b, double reach_px) {
  return std::ranges::all_of(a, [&](const lens::Vec2& corner) {
    return std::ranges::any_of(b, [&](const lens::Vec2& other) {
      return (corner - other).squaredNorm() < reach_px * reach_px;
    });
  });
}

void QuadSet::Clear() {
  std::ranges::fill(first_, -1);
  entries_.clear();
}

std::size_t QuadSet::ChainOf(int place_u, int place_v) {
  const auto hash =
      static_cast<std::size_t>(place_u) * 73856093 ^ static_cast<std::size_t>(place_v) * 19349663;
  return hash % kChains;
}

bool QuadSet::Add(const Corners& quad, double reach_px) {
  const lens::Vec2 middle = 0.25 * (quad[0] + quad[1] + quad[2] + quad[3]);
  const int place_u = static_cast<int>(std::floor(middle.x() / kPlace_px));
  const int place_v = static_cast<int>(std::floor(middle.y() / kPlace_px));
  for (int u = place_u - 1; u <= place_u + 1; ++u) {
    for (int v = place_v - 1; v <= place_v + 1; ++v) {
      for (int k = first_[ChainOf(u, v)]; k >= 0; k = entries_[k].next) {
        if (AreAlike(quad, entries_[k].quad, reach_px)) return false;
      }
    }
  }
  int& first = first_[ChainOf(place_u, place_v)];
  entries_.push_back({quad, first});
  first = static_cast<int>(entries_.size()) - 1;
  return true;
}

int QuadFinder::RootOf(int run) {
  while (runs_[run].parent != run) {
    runs_[run].parent = runs_[runs_[run].parent].parent;
    run = runs_[run].parent;
  }
  return run;
}

void QuadFinder::FindRuns(const SearchImage& search) {
  runs_.clear();
  std::size_t above = 0, above_end = 0;  // runs of the row above
  for (int y = 0; y < search.height; ++y) {
    const std::uint8_t* row = &search.dark[static_cast<std::size_t>(y) * search.width];
    const std::uint8_t* const end = row + search.width;
    const std::size_t first = runs_.size();
    for (const std::uint8_t* p = row; (p = FirstOf(p, end, 1)) != end;) {
      const std::uint8_t* const stop = FirstOf(p, end, 0);
      const int index = static_cast<int>(runs_.size());
      const int x0 = static_cast<int>(p - row), x1 = static_cast<int>(stop - row);
      runs_.push_back({y, x0, x1, index, -1});
      while (above < above_end && runs_[above].x1 <= x0) ++above;
      for (std::size_t other = above; other < above_end && runs_[other].x0 < x1; ++other) {
        const int a = RootOf(static_cast<int>(other)), b = RootOf(index);
        // The older run becomes the root, so that parents always precede their children.
        if (a != b) runs_[std::max(a, b)].parent = std::min(a, b);
      }
      p = stop;
    }
    above = first;
    above_end = runs_.size();
  }
}

void QuadFinder::SelectRegions(const Limits& limits) {
  regions_.clear();
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const Run run = runs_[i];
    const int root = RootOf(static_cast<int>(i));
    if (root == static_cast<int>(i)) {
      runs_[i].region = static_cast<int>(regions_.size());
      regions_.push_back({run.x0, run.y, run.x1, run.y + 1, root, 0});
      continue;
    }
    Region& region = regions_[runs_[root].region];
    region.x0 = std::min(region.x0, run.x0);
    region.x1 = std::max(region.x1, run.x1);
    region.y1 = run.y + 1;
  }
  for (const Region& region : regions_) runs_[region.root].region = -1;
  std::erase_if(regions_, [&](const Region& r) {
    return std::min(r.x1 - r.x0, r.y1 - r.y0) < limits.min_side ||
           std::max(r.x1 - r.x0, r.y1 - r.y0) > limits.max_side;
  });
  limited_ = static_cast<int>(regions_.size()) > limits.max_regions;
  if (limited_) {
    const auto size = [](const Region& r) { return (r.x1 - r.x0) + (r.y1 - r.y0); };
    std::nth_element(regions_.begin(), regions_.begin() + limits.max_regions, regions_.end(),
                     [&](const Region& a, const Region& b) {
                       return size(a) != size(b) ? size(a) > size(b) : a.root < b.root;
                     });
    regions_.resize(limits.max_regions);
  }
}

void QuadFinder::CollectRows() {
  int rows = 0;
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    runs_[regions_[i].root].region = static_cast<int>(i);
    regions_[i].first_row = rows;
    rows += regions_[i].y1 - regions_[i].y0;
  }
  rows_.assign(rows, {1 << 30, -1});
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const int region = runs_[RootOf(static_cast<int>(i))].region;
    if (region < 0) continue;
    Extent& extent = rows_[regions_[region].first_row + runs_[i].y - regions_[region].y0];
    extent.x0 = std::min(extent.x0, runs_[i].x0);
    extent.x1 = std::max(extent.x1, runs_[i].x1);
  }
}

/// Convex hull of the region's boundary (midpoints of its outer pixel edges), clockwise.
void QuadFinder::HullOf(const Region& region) {
  right_.clear();
  left_.clear();
  const int last = region.y1 - region.y0 - 1;
  const auto add = [&](double x0, double x1, double y) {
    AddToChain(left_, {x0, y}, -1);
    AddToChain(right_, {x1, y}, 1);
  };
  const Extent top = rows_[region.first_row], bottom = rows_[region.first_row + last];
  add(top.x0, top.x1 - 1, region.y0 - 0.5);
  for (int k = 0; k <= last; ++k) {
    const Extent extent = rows_[region.first_row + k];
    add(extent.x0 - 0.5, extent.x1 - 0.5, region.y0 + k);
  }
  add(bottom.x0, bottom.x1 - 1, region.y1 - 0.5);
  hull_.assign(right_.begin(), right_.end());
  hull_.insert(hull_.end(), left_.rbegin(), left_.rend());
  hull_.erase(std::unique(hull_.begin(), hull_.end()), hull_.end());
  if (hull_.size() > 1 && hull_.front() == hull_.back()) hull_.pop_back();
}

/// The largest quadrilateral with corners on the hull: for each diagonal the farthest point on
/// either side, which advances as the diagonal rotates. Quadratic in the number of hull points.
bool QuadFinder::LargestQuad(Corners& quad) const {
  const int n = static_cast<int>(hull_.size());
  if (n < 4 || hull_.size() > kMaxHullPoints) return false;
  const auto at = [&](int i) -> const lens::Vec2& { return hull_[i < n ? i : i - n]; };
  double hull_area = 0, best = 0;
  for (int i = 1; i + 1 < n; ++i) hull_area += Area2(hull_[0], hull_[i], hull_[i + 1]);
  int corner[4] = {};
  for (int i = 0; i + 2 < n; ++i) {
    int a = i + 1, b = i + 3;
    for (int j = i + 2; j < std::min(n, i + n - 1); ++j) {
      while (a + 1 < j && Area2(at(i), at(a + 1), at(j)) >= Area2(at(i), at(a), at(j))) ++a;
      b = std::max(b, j + 1);
      while (b + 1 < i + n && Area2(at(j), at(b + 1), at(i)) >= Area2(at(j), at(b), at(i))) ++b;
      const double area = Area2(at(i), at(a), at(j)) + Area2(at(j), at(b), at(i));
      if (area <= best) continue;
      best = area;
      corner[0] = i, corner[1] = a, corner[2] = j, corner[3] = b;
    }
  }
  if (!(best >= kMinShareOfHull * hull_area)) return false;
  for (int k = 0; k < 4; ++k) quad[k] = at(corner[k]);
  for (int k = 0; k < 4; ++k) {
    const double side = (quad[(k + 1) % 4] - quad[k]).norm();
    // Sine of the corner's angle, at least that of 15 degrees.
    const double turn = Area2(quad[k], quad[(k + 1) % 4], quad[(k + 2) % 4]);
    const double next = (quad[(k + 2) % 4] - quad[(k + 1) % 4]).norm();
    if (side < kMinSide_px || turn < 0.26 * side * next) return false;
  }
  return true;
}

void QuadFinder::Find(const SearchImage& search, const Limits& limits,
                      std::vector<Corners>& quads) {
  FindRuns(search);
  SelectRegions(limits);
  CollectRows();
  for (const Region& region : regions_) {
    HullOf(region);
    Corners quad;
    if (!LargestQuad(quad)) continue;
    for (lens::Vec2& corner : quad) corner = search.ImagePixel(corner.x(), corner.y());
    quads.push_back(quad);
  }
}

}  // namespace plumbline::vision
