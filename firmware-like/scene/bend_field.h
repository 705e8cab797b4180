// Bend field: displacement and rotation of the loaded tool along its axis.
#pragma once

#include <array>
#include <cstddef>

#include "firmware-like/geometry/pose.h"

namespace plumbline::scene {

/// Number of stations along the tool. The field stores the displacement d and the rotation vector r
/// of the tool's sections at stations along z of the flange frame F, the axis of the tool:
///   z_i = i length / (kBendStations - 1) + off_i,  i = 0 .. kBendStations - 1
/// The offset is usually zero, and always at both ends. It moves a station to a step in the tool's
/// section, where r has a kink. The z_i are ascending. A point p of the tool moves to
///   p' = p + d(z) + r(z) x (p.x, p.y, 0)        [small rotations; sections remain plane]
/// with d the cubic through d_i with slopes (r_y, -r_x), the shape functions of a beam element, and
/// r linear between stations. Inboard of the flange (z < 0) nothing moves; beyond the tip (z >
/// length) the motion of the tip section continues rigidly:
///   p' = p + d(L) + r(L) x (p - (0, 0, L)).
/// Valid for |d|/L < 0.05, like the beam.
inline constexpr int kBendStations = 33;

struct BendStation {
  Vec3f d_F = Vec3f::Zero();  ///< [m]
  Vec3f r_F = Vec3f::Zero();  ///< [rad]
  float stress_Pa = 0;        ///< largest von Mises stress of the section; 0: unknown
  float off_m = 0;            ///< offset from the evenly spaced position

  bool operator==(const BendStation&) const = default;
};

struct BendField {
  float length_m = 0;  ///< 0: rigid tool without bending
  std::array<BendStation, kBendStations> stations = {};

  double StationZ(int i) const {
    return i * (static_cast<double>(length_m) / (kBendStations - 1)) +
           static_cast<double>(stations[i].off_m);
  }
  bool operator==(const BendField&) const = default;
};

/// Position of a point of the bent tool; both in F [m]. The vertex shader computes the same.
Vec3 BentPoint(const BendField& field, const Vec3& p_F);

}  // namespace plumbline::scene
