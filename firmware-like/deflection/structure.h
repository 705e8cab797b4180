// Structural deflections: small rigid motions of everything outboard of a compliant bearing, link
// or guide.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline::deflection {

/// Motion of everything outboard per unit of its influence entry: a rotation about `centre`, then a
/// translation. In B.
template <typename T>
struct OutboardMotionOf {
  Vec3Of<T> turn = Vec3Of<T>::Zero();  ///< rotation vector [rad]
  Vec3Of<T> centre = Vec3Of<T>::Zero();
  Vec3Of<T> shift = Vec3Of<T>::Zero();  ///< [m]
};

/// Influence entries of a joint's structure, in the order in which they act: the end of the link
/// moves relative to the link, then the link moves with the carriage in its guide, then with the
/// bearing or beam.
inline constexpr std::array kStructureEntries = {
    effects::Influence<double>::kLinkTorsion, effects::Influence<double>::kLinkBending,
    effects::Influence<double>::kGuideTiltX, effects::Influence<double>::kGuideTiltY,
    effects::Influence<double>::kBearing};

/// Motion of the end of a cantilever per unit of L / (E I), under the moments at its root and its
/// tip. The moment decreases linearly from root to tip.
///   turn = (M_root + M_tip)_perp / 2,  shift = (M_root / 3 + M_tip / 6) x beam
///                                                          [Gere & Timoshenko, ch. 9]
/// @param end   end of the cantilever in B [m]
/// @param beam  vector from root to end [m]
template <typename T>
OutboardMotionOf<T> CantileverMotion(const Vec3Of<T>& end, const Vec3Of<T>& beam,
                                     const Vec3Of<T>& M_root, const Vec3Of<T>& M_tip) {
  constexpr double kShortest_m2 = 1e-12;
  OutboardMotionOf<T> motion;
  motion.centre = end;
  const T length2 = beam.squaredNorm();
  if (!(length2 > T(kShortest_m2))) return motion;
  const Vec3Of<T> mean = (M_root + M_tip) / T(2);
  motion.turn = mean - beam * (beam.dot(mean) / length2);
  motion.shift = (M_root / T(3) + M_tip / T(6)).cross(beam);
  return motion;
}

/// Half the length over which a carriage is supported by its guide [m]; an assumption, see the
/// effect guide_play.
inline constexpr double kHalfCarriage_m = 0.025;

/// Tilt of a carriage with play under the moment M_B, about the axis `across`, per unit of half its
/// play.
///   turn = across M / sqrt(M^2 + (W h)^2),  M = across . M_B        see guide_play
/// @param weight_N  W: weight of everything that the carriage carries
template <typename T>
OutboardMotionOf<T> GuideMotion(const Vec3Of<T>& carriage, const Vec3Of<T>& across,
                                const Vec3Of<T>& M_B, const T& weight_N) {
  using std::sqrt;
  OutboardMotionOf<T> motion;
  motion.centre = carriage;
  if (!(weight_N > T(0))) return motion;
  const T M = across.dot(M_B), width = kHalfCarriage_m * weight_N;
  motion.turn = across * (M / sqrt(M * M + width * width));
  return motion;
}

/// Motions of one joint's structure under the weight outboard of it, one for each of
/// kStructureEntries; see the effects in effects/structure_effects.h.
/// @param g_B    gravity in B [m/s^2]
/// @param theta  actual position of the joint [rad] or [m]
template <typename T>
std::array<OutboardMotionOf<T>, kStructureEntries.size()> StructureMotions(
    const kinematics::Chain& chain, const kinematics::PostureOf<T>& posture,
    const loads::OutboardMassesOf<T>& outboard, const Vec3Of<T>& g_B, int joint, const T& theta) {
  const auto i = static_cast<std::size_t>(joint);
  const auto moment = [&](std::size_t beyond, const Vec3Of<T>& about) {
    return Vec3Of<T>((outboard[beyond].kg_m - outboard[beyond].kg * about).cross(g_B));
  };
  const Vec3Of<T>& start = posture.point_B[i];
  const Vec3Of<T> end = joint + 1 < posture.size ? posture.point_B[i + 1] : posture.X_BF().p;
  const Vec3Of<T>& axis = posture.axis_B[i];
  const Vec3Of<T> M_start = moment(i, start), M_end = moment(i + 1, end), link = end - start;
  OutboardMotionOf<T> torsion, guide_x, guide_y, bearing;
  const T length2 = link.squaredNorm();
  if (length2 > T(1e-12)) torsion = {link * (link.dot(M_end) / length2), end, Vec3Of<T>::Zero()};
  if (chain.type(joint) == model::JointType::kRevolute) {
    bearing = {M_start - axis * axis.dot(M_start), start, Vec3Of<T>::Zero()};
  } else {
    using std::abs;
    const Vec3Of<T>& carriage = posture.X_BL[i].p;
    const Vec3Of<T> extended = theta * axis;
    bearing = CantileverMotion<T>(carriage, extended, moment(i, carriage - extended),
                                  moment(i, carriage));
    bearing.turn *= abs(theta);
    bearing.shift *= abs(theta);
    const Vec3Of<T> M_carriage = moment(i, carriage), x = posture.X_BL[i].R.col(0);
    const T weight_N = outboard[i].kg * T(g_B.norm());
    guide_x = GuideMotion<T>(carriage, x, M_carriage, weight_N);
    guide_y = GuideMotion<T>(carriage, axis.cross(x), M_carriage, weight_N);
  }
  return {torsion, CantileverMotion<T>(end, link, M_start, M_end), guide_x, guide_y, bearing};
}

/// True if any structural entry is nonzero.
template <typename T>
bool HasStructuralCompliance(const effects::Influence<T>& influence, int joints) {
  for (const auto entry : kStructureEntries) {
    for (int joint = 0; joint < joints; ++joint) {
      const auto same = static_cast<typename effects::Influence<T>::JointEntry>(entry);
      if (!(influence.Joint(same, joint) == T(0))) return true;
    }
  }
  return false;
}

}  // namespace plumbline::deflection
