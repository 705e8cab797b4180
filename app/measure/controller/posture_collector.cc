#include "app/measure/controller/posture_collector.h"

#include <algorithm>
#include <limits>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/machine.h"

namespace plumbline::measure {
namespace {

constexpr double kApart = 0.1;  // [rad] or [m], of one joint at least

double Distance(const ControllerPosture& a, const ControllerPosture& b) {
  return (a.q - b.q).cwiseAbs().maxCoeff();
}

}  // namespace

bool PostureCollector::Add(const ControllerPosture& posture) {
  if (!postures_.empty() && postures_.front().q.size() != posture.q.size()) postures_.clear();
  const double nearest = DistanceToNearest(postures_, posture.q);
  if (nearest < kApart) return false;
  if (postures_.size() < most_) {
    postures_.push_back(posture);
    return true;
  }
  double least = std::numeric_limits<double>::infinity();
  std::size_t crowded = 0;
  for (std::size_t i = 1; i < postures_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double distance = Distance(postures_[i], postures_[j]);
      if (distance >= least) continue;
      least = distance;
      crowded = i;
    }
  }
  if (nearest <= least) return false;
  postures_[crowded] = posture;
  return true;
}

std::optional<ControllerPosture> ReadingFilter::Observe(const model::RobotState& reading) {
  const bool usable = reading.sequence != 0 && reading.X_BT && reading.q.size() > 0 &&
                      reading.q.allFinite() && reading.X_BT->p.allFinite() &&
                      reading.X_BT->R.allFinite();
  if (!usable) return std::nullopt;
  if (!last_.empty()) {
    if (last_.back().sequence == reading.sequence) return std::nullopt;
    if (last_.back().q.size() != reading.q.size()) last_.clear();
  }
  last_.push_back(reading);
  if (last_.size() < 3) return std::nullopt;
  if (last_.size() > 3) last_.erase(last_.begin());
  const model::RobotState &before = last_[0], &middle = last_[1], &after = last_[2];
  const double time_s = after.timestamp_s - before.timestamp_s;
  const double still = std::max(kSmallestMotion, 1.5 * reading.q_resolution);
  const bool at_rest = (after.q - before.q).cwiseAbs().maxCoeff() <= still &&
                       (middle.q - before.q).cwiseAbs().maxCoeff() <= still;
  if ((!at_rest && !moving_) || !(time_s > 0) || time_s > 2) return std::nullopt;
  ControllerPosture posture;
  posture.q = middle.q;
  posture.qd = at_rest ? model::JointVector(model::JointVector::Zero(middle.q.size()))
                       : model::JointVector((after.q - before.q) / time_s);
  posture.p = middle.X_BT->p;
  posture.R = middle.X_BT->R;
  posture.angles = VectorFromRotation(posture.R);
  posture.temp_C = middle.temp_C;
  posture.t_s = middle.timestamp_s;
  return posture;
}

}  // namespace plumbline::measure
