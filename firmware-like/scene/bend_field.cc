#include "firmware-like/scene/bend_field.h"

#include <algorithm>

namespace plumbline::scene {

Vec3 BentPoint(const BendField& field, const Vec3& p_F) {
  const double length = field.length_m;
  if (length <= 0 || p_F.z() <= 0) return p_F;
  const double z = std::min(p_F.z(), length);
  int i = std::min(static_cast<int>(z / length * (kBendStations - 1)), kBendStations - 2);
  while (i > 0 && z < field.StationZ(i)) --i;
  while (i < kBendStations - 2 && z > field.StationZ(i + 1)) ++i;
  const BendStation& a = field.stations[i];
  const BendStation& b = field.stations[static_cast<std::size_t>(i) + 1];
  const double step = field.StationZ(i + 1) - field.StationZ(i);
  const double t = (z - field.StationZ(i)) / step;
  const Vec3 r_a = a.r_F.cast<double>(), r_b = b.r_F.cast<double>();
  const auto slope = [](const Vec3& r) { return Vec3(r.y(), -r.x(), 0); };
  const double t2 = t * t, t3 = t2 * t;
  const Vec3 d = (2 * t3 - 3 * t2 + 1) * a.d_F.cast<double>() +
                 (3 * t2 - 2 * t3) * b.d_F.cast<double>() +
                 step * ((t3 - 2 * t2 + t) * slope(r_a) + (t3 - t2) * slope(r_b));
  const Vec3 r = (1 - t) * r_a + t * r_b;
  return p_F + d + r.cross(p_F - Vec3(0, 0, z));
}

}  // namespace plumbline::scene
