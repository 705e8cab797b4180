#include "app/cell/scene/triangle_pair.h"

#include <algorithm>
#include <limits>

namespace plumbline::cell {
namespace {

/// Extent of a triangle along an axis.
struct Extent {
  double low, high;
};

Extent ExtentOf(const Corners& triangle, const Vec3& axis) {
  const double p = axis.dot(triangle[0]), q = axis.dot(triangle[1]), r = axis.dot(triangle[2]);
  return {std::min({p, q, r}), std::max({p, q, r})};
}

/// Calls `holds` for each potential separating axis until it returns false.
/// @return  whether it returned true for all
template <typename Holds>
bool ForEachAxis(const Corners& a, const Corners& b, const Holds& holds) {
  const std::array<Vec3, 3> ab = {a[1] - a[0], a[2] - a[1], a[0] - a[2]},
                            cd = {b[1] - b[0], b[2] - b[1], b[0] - b[2]};
  const Vec3 n = ab[0].cross(ab[1]), m = cd[0].cross(cd[1]);
  if (!holds(n) || !holds(m)) return false;
  for (const Vec3& edge : ab) {
    for (const Vec3& other : cd) {
      if (!holds(edge.cross(other))) return false;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!holds(ab[i].cross(n)) || !holds(cd[i].cross(m))) return false;
  }
  return true;
}

/// Point at which the edge from p to q passes through a triangle.
std::optional<Vec3> Passes(const Vec3& p, const Vec3& q, const Corners& triangle) {
  const Vec3 ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0];
  const Vec3 n = ab.cross(ac), pq = q - p;
  const double slope = n.dot(pq);
  if (slope == 0) return std::nullopt;
  const double at = n.dot(triangle[0] - p) / slope;
  if (at < 0 || at > 1) return std::nullopt;
  const Vec3 point = p + at * pq, ap = point - triangle[0];
  const double u = n.dot(ap.cross(ac)), v = n.dot(ab.cross(ap)), all = n.squaredNorm();
  if (u < 0 || v < 0 || u + v > all) return std::nullopt;
  return point;
}

}  // namespace

bool TrianglesCross(const Corners& a, const Corners& b) {
  return ForEachAxis(a, b, [&](const Vec3& axis) {
    const Extent of_a = ExtentOf(a, axis), of_b = ExtentOf(b, axis);
    return of_a.low <= of_b.high && of_b.low <= of_a.high;
  });
}

TriangleExit ExitOf(const Corners& a, const Corners& b, const Vec3& along) {
  TriangleExit exit{std::numeric_limits<double>::infinity(), along};
  ForEachAxis(a, b, [&](const Vec3& axis) {
    const double speed = axis.dot(along);
    if (speed == 0) return true;
    const Extent of_a = ExtentOf(a, axis), of_b = ExtentOf(b, axis);
    const double way_m = (speed > 0 ? of_b.high - of_a.low : of_b.low - of_a.high) / speed;
    if (way_m < exit.way_m) exit = {way_m, speed > 0 ? axis : Vec3(-axis)};
    return true;
  });
  exit.way_m = std::max(exit.way_m, 0.0);
  return exit;
}

std::optional<Vec3> MiddleOfCrossing(const Corners& a, const Corners& b) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (const auto& point : {Passes(a[i], a[(i + 1) % 3], b), Passes(b[i], b[(i + 1) % 3], a)}) {
      if (!point) continue;
      sum += *point;
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return Vec3(sum / count);
}

}  // namespace plumbline::cell
