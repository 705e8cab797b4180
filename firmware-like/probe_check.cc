#include "firmware-like/probe_check.h"

#include <algorithm>

namespace plumbline {
namespace {

constexpr double kReachMargin = 1.1;
constexpr double kFinestStep_m = 1e-6;  // finest resolution of a probe register
constexpr double kSamePlace = 0.1;      // as a share of the reach

}  // namespace

ProbeBounds ProbeBoundsOf(const deflection::LoadedArm& arm,
                          const correction::CorrectionLimits& limits) {
  double tool_m = 0;  // the longest one
  for (int tool = 0; tool < arm.tools(); ++tool) tool_m = std::max(tool_m, arm.X_FT(tool).p.norm());
  const double length_m = arm.chain().Reach() + tool_m;
  return {.reach_m = kReachMargin * length_m,
          .contradiction_m = limits.max_translation_m + kUndeclaredTurn_rad * length_m};
}

bool Contradicts(const ProbeBounds& bounds, const Vec3& measured_W, const Vec3& predicted_W) {
  return !((measured_W - predicted_W).norm() <= bounds.contradiction_m);
}

ProbeFault CheckProbe(const deflection::LoadedArm& arm, const ProbeBounds& bounds,
                      const Vec3& measured_W, const Vec3& predicted_W) {
  if (measured_W.cwiseAbs().maxCoeff() < 0.5 * kFinestStep_m) return ProbeFault::kZero;
  const double same_place_m = std::max(bounds.contradiction_m, kSamePlace * bounds.reach_m);
  if (Contradicts(bounds, measured_W, predicted_W) &&
      (1e3 * measured_W - predicted_W).norm() <= same_place_m) {
    return ProbeFault::kInMetres;
  }
  const bool within = (measured_W - arm.X_WB().p).norm() <= bounds.reach_m;
  return within ? ProbeFault::kNone : ProbeFault::kBeyondReach;
}

bool IsZeroOrInMetres(const model::Robot& robot, const ProbeBounds& bounds, const Vec3& p_B) {
  const bool turns =
      !robot.joints.empty() && robot.joints.front().type == model::JointType::kRevolute;
  return turns && 1e3 * p_B.norm() <= bounds.reach_m;
}

}  // namespace plumbline
