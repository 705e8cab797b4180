// How the loaded tool stands along its axis: what its mesh, and what it carries, follow.
#pragma once

#include <array>
#include <cstddef>

#include "firmware-like/geometry/pose.h"

namespace plumbline {

/// Displacement d and rotation vector r of the tool's sections at stations along z, in the flange
/// frame F, whose z is the tool's axis:
///   z_i = i length / (kBendStations - 1) + off_i,  i = 0 .. kBendStations - 1
/// The offset, zero as a rule and always at both ends, brings a station to where the tool's section
/// changes: r has a kink there. The z_i ascend. A point p of the tool goes to
///   p' = p + d(z) + r(z) x (p.x, p.y, 0)        [small rotations: a beam's section stays plane]
/// with d the cubic through d_i and its slopes (r_y, -r_x), the element's shape functions, and r
/// linear between stations. Inboard of the flange (z < 0) nothing bends; beyond the tip (z >
/// length) the section at the tip carries on rigidly:
///   p' = p + d(L) + r(L) x (p - (0, 0, L)).
/// Valid as the beam is, |d|/L < 0.05.
inline constexpr int kBendStations = 33;

struct BendStation {
  Vec3f d_F = Vec3f::Zero();  ///< [m]
  Vec3f r_F = Vec3f::Zero();  ///< [rad]
  float stress_Pa = 0;        ///< von Mises, largest of the section; 0: not known
  float off_m = 0;
};

struct BendField {
  float length_m = 0;  ///< 0: rigid, nothing bends
  std::array<BendStation, kBendStations> stations = {};

  double StationZ(int i) const {
    return i * (static_cast<double>(length_m) / (kBendStations - 1)) +
           static_cast<double>(stations[static_cast<std::size_t>(i)].off_m);
  }
};

/// The point carried by the bent tool; both in F [m]. What the vertex shader computes, too.
Vec3 BentPoint(const BendField& field, const Vec3& p_F);

}  // namespace plumbline
