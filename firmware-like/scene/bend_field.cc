#include "firmware-like/scene/bend_field.h"

#include <algorithm>

namespace plumbline {

Vec3 BentPoint(const BendField& field, const Vec3& p_F) {
  const double length = field.length_m;
  if (length <= 0 || p_F.z() <= 0) return p_F;
  const double step = length / (kBendStations - 1);
  const double z = std::min(p_F.z(), length);
  const int i = std::min(static_cast<int>(z / step), kBendStations - 2);
  const double t = z / step - i;
  const BendStation& a = field.stations[static_cast<std::size_t>(i)];
  const BendStation& b = field.stations[static_cast<std::size_t>(i) + 1];
  const Vec3 r_a = a.r_F.cast<double>(), r_b = b.r_F.cast<double>();
  const auto slope = [](const Vec3& r) { return Vec3(r.y(), -r.x(), 0); };
  const double t2 = t * t, t3 = t2 * t;
  const Vec3 d = (2 * t3 - 3 * t2 + 1) * a.d_F.cast<double>() +
                 (3 * t2 - 2 * t3) * b.d_F.cast<double>() +
                 step * ((t3 - 2 * t2 + t) * slope(r_a) + (t3 - t2) * slope(r_b));
  const Vec3 r = (1 - t) * r_a + t * r_b;
  return p_F + d + r.cross(p_F - Vec3(0, 0, z));
}

}  // namespace plumbline
