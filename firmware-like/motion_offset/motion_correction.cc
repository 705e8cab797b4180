#include "firmware-like/motion_offset/motion_correction.h"

#include <algorithm>
#include <cmath>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::motion_offset {
namespace {

// Joints of packet and robot link may differ by a tolerance at rest, and by what a fast axis moves
// since the reading. A wrong sign, unit or order of the joints is farther off in most postures.
constexpr double kRestTolerance_rad = 0.02, kAxisSpeed_rad_per_s = 3;

/// The reading may count turns otherwise than the packet.
bool Disagree(const CycleReport& report, const model::JointVector& q, double now_s) {
  if (report.q.size() != q.size()) return true;
  const double age_s = std::clamp(now_s - report.q_s, 0.0, kOldestReport_s);
  const double allowed = kRestTolerance_rad + kAxisSpeed_rad_per_s * age_s;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    if (!(std::abs(std::remainder(report.q[k] - q[k], 2 * M_PI)) <= allowed)) return true;
  }
  return false;
}

/// The obstacle that does not depend on the correction itself.
Obstacle ObstacleBefore(const CycleReport& report, const MotionModel* model,
                        const CorrectionRules& rules, const model::JointVector& q, double now_s) {
  if (model == nullptr || report.now_s <= 0 || now_s - report.now_s > kOldestReport_s ||
      report.generation != model->generation) {
    return Obstacle::kNoCycle;
  }
  if (!report.enabled) return Obstacle::kNotEnabled;
  if (!report.plc_alive) return Obstacle::kHeartbeatLost;
  if (report.compensated_twice) return Obstacle::kCompensatedTwice;
  if (!report.robot_trusted) return Obstacle::kRobotNotTrusted;
  if (q.size() != model->corrector.arm().size() || !q.allFinite()) return Obstacle::kNoJoints;
  if (Disagree(report, q, now_s)) return Obstacle::kJointsDisagree;
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
