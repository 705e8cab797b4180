#include "app/measure/controller/posture_collector.h"

#include <algorithm>
#include <limits>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/loads/numbered_load.h"
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

void PostureCollector::Expire(double before_s) {
  postures_.erase(std::remove_if(postures_.begin(), postures_.end(),
                                 [before_s](const ControllerPosture& posture) {
                                   return posture.t_s && *posture.t_s < before_s;
                                 }),
                  postures_.end());
}

std::optional<ControllerPosture> PostureFromReading(const model::RobotState& reading,
                                                    const model::CellModel& cell) {
  const bool usable = reading.sequence != 0 && reading.X_BT && reading.q.size() > 0 &&
                      reading.q.allFinite() && reading.X_BT->p.allFinite() &&
                      reading.X_BT->R.allFinite();
  const std::optional<int> tool = loads::ToolIndexOf(cell, reading.tool_number);
  if (!usable || !tool) return std::nullopt;
  ControllerPosture posture;
  posture.q = reading.q;
  posture.p = reading.X_BT->p;
  posture.R = reading.X_BT->R;
  posture.angles = VectorFromRotation(posture.R);
  posture.temp_C = reading.temp_C;
  posture.t_s = reading.timestamp_s;
  posture.tool = *tool;
  posture.X_FT = reading.X_FT;
  posture.of_flange = reading.tcp_is_flange;
  return posture;
}

std::optional<ControllerPosture> ReadingFilter::Observe(const model::RobotState& reading,
                                                        const model::CellModel& cell) {
  if (!PostureFromReading(reading, cell)) return std::nullopt;
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
  // A tool that is changed between two readings belongs to neither posture.
  const bool one_tool = before.tool_number == after.tool_number;
  std::optional<ControllerPosture> posture = PostureFromReading(middle, cell);
  if (!posture || !one_tool) return std::nullopt;
  posture->qd = at_rest ? model::JointVector(model::JointVector::Zero(middle.q.size()))
                        : model::JointVector((after.q - before.q) / time_s);
  return posture;
}

}  // namespace plumbline::measure
