#include "firmware-like/motion/motion_observer.h"

#include <algorithm>

#include "firmware-like/statistics/containment_radius.h"
#include "firmware-like/statistics/student.h"

namespace plumbline::motion {
namespace {

constexpr int kMostFreedom = 30;  // beyond that, Student's factor is within 4 % of the normal one

}  // namespace

const char* Describe(MotionState state) {
  switch (state) {
    case MotionState::kUnknown:
      return "unknown";
    case MotionState::kStandstill:
      return "at standstill";
    case MotionState::kMoving:
      return "moving";
    case MotionState::kReadingsTooSlow:
      return "moving; the readings change too rarely for an acceleration";
    case MotionState::kLoadUnknown:
      return "moving; payload or link masses are unknown";
  }
  return "?";
}

MotionObserver::MotionObserver(const model::CellModel& cell) : model_(cell) {
  const double normal = statistics::StudentCoverageFactor(statistics::kTwoSigmaCoverage, 1e9);
  coverage_.push_back(1);
  for (int freedom = 1; freedom <= kMostFreedom; ++freedom) {
    coverage_.push_back(statistics::StudentCoverageFactor(statistics::kTwoSigmaCoverage, freedom) /
                        normal);
  }
}

void MotionObserver::Observe(const model::RobotState& reading, bool standstill) {
  trusted_ = true;
  standstill_ = standstill;
  if (standstill) {
    estimator_.ObserveStandstill(reading);
  } else {
    estimator_.ObserveMoving(reading);
  }
}

void MotionObserver::Forget() {
  trusted_ = false;
  estimator_.Forget();
}

MotionStatus MotionObserver::Status(const deflection::LoadedArm& arm, double now_s,
                                    const std::optional<loads::Payload>& payload,
                                    const effects::Conditions& conditions) const {
  MotionStatus status;
  status.deflection.sag = model::JointVector::Zero(arm.size());
  if (!trusted_) return status;
  if (standstill_) {
    status.state = MotionState::kStandstill;
    return status;
  }
  const std::optional<JointMotion> motion = estimator_.Estimate();
  if (!motion) {
    status.state = estimator_.full() ? MotionState::kReadingsTooSlow : MotionState::kUnknown;
    return status;
  }
  if (!payload || arm.torques_missing()) {
    status.state = MotionState::kLoadUnknown;
    return status;
  }
  status.state = MotionState::kMoving;
  status.age_s = std::max(0.0, now_s - motion->time_s);
  Mat3 covariance;
  status.deflection = model_.At(arm, *motion, *payload, conditions, covariance);
  const auto freedom = static_cast<std::size_t>(std::min(motion->freedom, kMostFreedom));
  status.radius_m = coverage_[freedom] * statistics::RadiusHolding95Percent(covariance);
  return status;
}

void MotionObserver::ResumeFrom(const MotionObserver& previous) {
  estimator_ = previous.estimator_;
  trusted_ = previous.trusted_;
  standstill_ = previous.standstill_;
}

}  // namespace plumbline::motion
