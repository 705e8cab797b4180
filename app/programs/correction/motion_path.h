// Path of the tool point during a linear or circular motion.
#pragma once

#include <optional>

#include "firmware-like/geometry/pose.h"

namespace plumbline::programs {

/// A straight line or, with an auxiliary point, the arc through it, of a tool point. The
/// orientation turns uniformly about one axis, from that of the start to that of the end.
struct MotionPath {
  Pose start, end;
  std::optional<Vec3> via;  ///< of a circular motion [m]

  /// @param share  of the path's length, 0..1
  Pose At(double share) const;
  double Length() const;  ///< [m]
  /// Distance of a point from the path near a share of it: the motion along the path does not count
  /// [m].
  double DistanceOf(const Vec3& p, double share) const;

 private:
  struct Arc {
    Vec3 centre, from, across;  ///< across: of the length of from, a quarter turn on
    double angle_rad = 0;
  };
  std::optional<Arc> ArcOf() const;
};

}  // namespace plumbline::programs
