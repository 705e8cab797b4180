// Growth of a fitted model's error, and fading of its correction, with distance from the fitted
// poses.
#pragma once

#include "firmware-like/kinematics/pose_distance.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::deflection {

/// The error of a correction grows with the distance from the fitted poses. With d the distance
/// from those poses (pose_distance.h) and r the reach (Domain::reach),
///   E^2(d) = distant_sigma^2 max(0, d^2 - r^2)
/// is the variance added per axis. A correction with confirmed causes is applied everywhere: share
/// 1, added variance E^2. Otherwise let S^2 be the variance that the declared model leaves
/// (Domain::declared_sigma). If the error e of the correction c = y + e is independent of the
/// deviation y to be corrected, the best share is
///   S^2 / (S^2 + E^2)
/// in the least mean square sense, and the remaining variance is E^2 S^2 / (S^2 + E^2), below that
/// of no correction. Both hold on average over poses and under that assumption, not for each cell:
/// tests/evaluation/other_regions.py counts the cells in which the correction is nevertheless worse
/// than none. [linear minimum mean square estimate; Kay, Fundamentals of Statistical Signal
/// Processing I (1993), ch. 12]. Allocates only on construction.
class DistanceGrowth {
 public:
  /// @param domain  of the cell; null if it has none, which means share 1 and no added variance
  DistanceGrowth(const kinematics::Chain& chain, const Vec3& tip_F, const model::Domain* domain);

  /// Share of the correction that is applied at q.
  double Share(const model::JointVector& q) const { return fades_ ? ShareAt(Gained(q)) : 1; }
  /// Variance per axis added because of the distance of q from the fitted poses [m^2].
  double Variance(const model::JointVector& q) const {
    const double gained_m2 = Gained(q);
    return fades_ ? ShareAt(gained_m2) * gained_m2 : gained_m2;
  }
  bool fades() const { return fades_; }

 private:
  double Gained(const model::JointVector& q) const;
  double ShareAt(double gained_m2) const { return declared_m2_ / (declared_m2_ + gained_m2); }

  kinematics::PoseDistance distance_;
  double distant_m2_ = 0;   ///< per square radian
  double reach2_ = 0;       ///< [rad^2]
  double declared_m2_ = 0;  ///< S^2
  bool fades_ = false;
};

}  // namespace plumbline::deflection
