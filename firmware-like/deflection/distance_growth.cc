#include "firmware-like/deflection/distance_growth.h"

#include <algorithm>

namespace plumbline::deflection {
namespace {

std::span<const model::JointVector> FittedPoses(const model::Domain* domain) {
  if (domain == nullptr || !domain->distant_sigma_m) return {};
  return domain->poses;
}

double Squared(double value) {
  return value * value;
}

}  // namespace

DistanceGrowth::DistanceGrowth(const kinematics::Chain& chain, const Vec3& tip_F,
                               const model::Domain* domain)
    : distance_(chain, tip_F, FittedPoses(domain)) {
  if (distance_.empty()) return;
  distant_m2_ = Squared(*domain->distant_sigma_m);
  reach2_ = Squared(domain->reach_rad);
  declared_m2_ = Squared(domain->declared_sigma_m.value_or(0));
  fades_ = declared_m2_ > 0 && distant_m2_ > 0;
}

double DistanceGrowth::Gained(const model::JointVector& q) const {
  if (distance_.empty()) return 0;
  return distant_m2_ * std::max(0.0, Squared(distance_.Of(q)) - reach2_);
}

}  // namespace plumbline::deflection
