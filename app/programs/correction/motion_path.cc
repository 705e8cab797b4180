#include "app/programs/correction/motion_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs {

/// The circle through start, via and end; nullopt if they are on one line. With a and b from the
/// start to the others, its centre is at
///   ((|a|^2 b - |b|^2 a) x (a x b)) / (2 |a x b|^2)
std::optional<MotionPath::Arc> MotionPath::ArcOf() const {
  if (!via) return std::nullopt;
  const Vec3 a = *via - start.p, b = end.p - start.p, normal = a.cross(b);
  const double square = normal.squaredNorm();
  if (square < 1e-12 * a.squaredNorm() * b.squaredNorm() || square == 0) return std::nullopt;
  const Vec3 to_centre = (a.squaredNorm() * b - b.squaredNorm() * a).cross(normal) / (2 * square);
  Arc arc;
  arc.centre = start.p + to_centre;
  arc.from = -to_centre;
  arc.across = normal.normalized().cross(arc.from);
  const auto angle_of = [&](const Vec3& p) {
    const Vec3 r = p - arc.centre;
    const double angle = std::atan2(r.dot(arc.across), r.dot(arc.from));
    return angle < 0 ? angle + 2 * std::numbers::pi : angle;
  };
  arc.angle_rad = angle_of(end.p);
  return arc;
}

Pose MotionPath::At(double share) const {
  const Vec3 turn = VectorFromRotation(end.R * start.R.transpose());
  Pose pose{RotationFromVector(share * turn) * start.R, start.p + share * (end.p - start.p)};
  if (const auto arc = ArcOf()) {
    const double angle = share * arc->angle_rad;
    pose.p = arc->centre + std::cos(angle) * arc->from + std::sin(angle) * arc->across;
  }
  return pose;
}

double MotionPath::Length() const {
  const auto arc = ArcOf();
  return arc ? arc->angle_rad * arc->from.norm() : (end.p - start.p).norm();
}

double MotionPath::DistanceOf(const Vec3& p, double share) const {
  constexpr double kStep = 1e-4;
  const Vec3 at = At(share).p;
  const Vec3 along = At(std::min(share + kStep, 1.0)).p - At(std::max(share - kStep, 0.0)).p;
  Vec3 off = p - at;
  // At the ends, the motion along the path is an error, too.
  const bool inside = share > 0 && share < 1;
  if (inside && along.norm() > 0) off -= along.normalized().dot(off) * along.normalized();
  return off.norm();
}

}  // namespace plumbline::programs
