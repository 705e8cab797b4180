#include "firmware-like/motion_offset/motion_correction.h"

#include "firmware-like/geometry/rotation.h"

namespace plumbline::motion_offset {
namespace {

/// A report older than several control cycles means that the cycle stands still.
constexpr double kOldestReport_s = 0.25;
/// An axis moves up to 3 rad/s, and the robot link's reading is up to 0.1 s old; a wrong sign, unit
/// or order of the joints is farther off in nearly every posture.
constexpr double kLargestDisagreement = 0.3;  // [rad] or [m]

/// The obstacle that does not depend on the correction itself.
Obstacle ObstacleBefore(const CycleReport& report, const MotionModel* model,
                        const CorrectionRules& rules, const model::JointVector& q, double now_s) {
  if (model == nullptr || report.now_s <= 0 || now_s - report.now_s > kOldestReport_s ||
      report.generation != model->generation) {
    return Obstacle::kNoCycle;
  }
  if (!report.enabled) return Obstacle::kNotEnabled;
  if (!report.plc_alive) return Obstacle::kHeartbeatLost;
  if (!report.robot_trusted) return Obstacle::kRobotNotTrusted;
  if (q.size() != model->corrector.arm().size() || !q.allFinite()) return Obstacle::kNoJoints;
  if (report.q.size() != q.size() || (report.q - q).cwiseAbs().maxCoeff() > kLargestDisagreement) {
    return Obstacle::kJointsDisagree;
  }
  if (!report.payload) return Obstacle::kPayloadUnknown;
  if (report.radius.basis < rules.weakest_basis || !report.radius.known()) {
    return Obstacle::kBasisTooWeak;
  }
  if (report.radius.radius_m > rules.widest_radius_m) return Obstacle::kRadiusTooWide;
  return Obstacle::kNone;
}

}  // namespace

MotionOffset::Order OrderFor(const CycleReport& report, const MotionModel* model,
                             const CorrectionRules& rules, const model::JointVector& q,
                             const Offset& applied, double now_s) {
  MotionOffset::Order order;
  order.obstacle = ObstacleBefore(report, model, rules, q, now_s);
  if (order.obstacle != Obstacle::kNone) return order;
  const deflection::LoadedArm& arm = model->corrector.arm();
  const Pose X_BT = arm.UnloadedTip(q, report.payload->tool);
  // Axes of the offset in B; a tool that the offset turns differs from it in the second order.
  const Mat3 R_BO =
      rules.frame == OffsetFrame::kTool ? Mat3(X_BT.R * rules.R_frame) : rules.R_frame;
  correction::AssemblyPoint point;
  const Pose X_BP = {RotationFromVector(R_BO * -applied.rotation) * X_BT.R,
                     X_BT.p - R_BO * applied.translation};
  point.X_WP = arm.X_WB() * X_BP;
  correction::Correction correction;
  model->corrector.Correct(point, *report.payload, report.conditions, q,
                           correction::BranchSearch::kNone, correction);
  if (correction.code != correction::CorrectionCode::kOk) {
    order.obstacle = correction.code == correction::CorrectionCode::kTooLarge ? Obstacle::kTooLarge
                                                                              : Obstacle::kRefused;
    return order;
  }
  order.wanted.translation = R_BO.transpose() * correction.translation_B;
  if (rules.rotates) order.wanted.rotation = R_BO.transpose() * correction.rotation_B;
  return order;
}

}  // namespace plumbline::motion_offset
