#include "firmware-like/correction/correct.h"

#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/kinematics/inverse.h"

namespace plumbline::correction {
namespace {

int Restarts(BranchSearch search) {
  switch (search) {
    case BranchSearch::kNone:
      return 0;
    case BranchSearch::kBrief:
      return 16;
    case BranchSearch::kThorough:
      return 128;
  }
  return 0;
}

Pose PointOfTip(const Pose& X_BT, const Vec3& p_TP) {
  return {X_BT.R, X_BT * p_TP};
}

/// Solves for the joints that bring the tool point to the target.
template <typename Tip>
CorrectionCode Solve(const kinematics::Chain& chain, const kinematics::PoseTarget& target,
                     const Tip& tip, const model::JointVector& seed, BranchSearch search,
                     model::JointVector& theta, kinematics::InverseOutcome& outcome) {
  if (search == BranchSearch::kNone) {
    constexpr int kIterations = 40;
    theta = seed;
    outcome = kinematics::SolvePose(chain, target, tip, kIterations, theta);
    if (!outcome.converged) return CorrectionCode::kUnreachable;
    return kinematics::WrapIntoLimits(chain, seed, theta) ? CorrectionCode::kOk
                                                          : CorrectionCode::kJointLimit;
  }
  switch (kinematics::SolvePoseOnNearestBranch(chain, target, tip, Restarts(search), seed, theta,
                                               outcome)) {
    case kinematics::BranchOutcome::kFound:
      return CorrectionCode::kOk;
    case kinematics::BranchOutcome::kOnlyOutsideLimits:
      return CorrectionCode::kJointLimit;
    case kinematics::BranchOutcome::kNone:
      return CorrectionCode::kUnreachable;
  }
  return CorrectionCode::kNotConverged;
}

double AngleBetween(const Mat3& a, const Mat3& b) {
  return VectorFromRotation(a * b.transpose()).norm();
}

}  // namespace

const char* Describe(CorrectionCode code) {
  switch (code) {
    case CorrectionCode::kOk:
      return "ok";
    case CorrectionCode::kUnreachable:
      return "out of reach";
    case CorrectionCode::kJointLimit:
      return "joint limit";
    case CorrectionCode::kSingular:
      return "singular posture";
    case CorrectionCode::kTooLarge:
      return "correction too large";
    case CorrectionCode::kNotConverged:
      return "not converged";
    case CorrectionCode::kTorquesUnknown:
      return "link masses not declared";
    case CorrectionCode::kPayloadUnknown:
      return "payload unknown";
    case CorrectionCode::kNoRobot:
      return "no trusted robot input";
    case CorrectionCode::kUnknownPoint:
      return "no such point";
    case CorrectionCode::kBadCommand:
      return "bad command";
    case CorrectionCode::kPending:
      return "pending";
    case CorrectionCode::kNotRecorded:
      return "probes are not recorded";
    case CorrectionCode::kNoCamera:
      return "no camera";
    case CorrectionCode::kLensStale:
      return "lens not valid";
    case CorrectionCode::kTipNotSeen:
      return "tool not seen by the camera, or moving";
    case CorrectionCode::kCamerasDisagree:
      return "the cameras contradict each other";
    case CorrectionCode::kProbeImplausible:
      return "probe implausible: zero, another unit, or beyond the arm's reach";
    case CorrectionCode::kRobotMoving:
      return "robot is moving";
    case CorrectionCode::kStorageUnavailable:
      return "journal not writable: disk full or read-only";
    case CorrectionCode::kProbeQuarantined:
      return "probe quarantined: contradicts the model, see plumbline journal";
  }
  return "?";
}

Corrector::Corrector(const model::CellModel& cell, const CorrectionLimits& limits)
    : cell_(cell),
      arm_(cell),
      limits_(limits),
      orientation_(
          kinematics::ReachableOrientation(arm_.chain(), deflection::FarthestTip_F(cell))) {}

void Corrector::Correct(const AssemblyPoint& point, const loads::Payload& payload,
                        const effects::Conditions& conditions, const model::JointVector& seed,
                        BranchSearch search, Correction& correction) const {
  const Pose X_BP = arm_.X_WB().Inverse() * point.X_WP;
  if (arm_.torques_missing()) {
    correction.code = CorrectionCode::kTorquesUnknown;
    return;
  }
  const double reach_m =
      arm_.chain().Reach() + arm_.X_FT(payload.tool).p.norm() + point.p_TP.norm();
  if (X_BP.p.norm() > reach_m + limits_.max_translation_m) {
    correction.code = CorrectionCode::kUnreachable;
    return;
  }
  deflection::LoadedState state;
  const auto loaded_point = [&](const model::JointVector& theta, kinematics::Posture& posture) {
    arm_.AtActual(theta, payload, conditions, state);
    posture = state.posture;
    return PointOfTip(state.X_BT, point.p_TP);
  };
  model::JointVector theta;
  kinematics::InverseOutcome outcome;
  const kinematics::PoseTarget target{
      X_BP, point.orientation_free ? kinematics::Orientation::kFree : orientation_};
  correction.code = Solve(arm_.chain(), target, loaded_point, seed, search, theta, outcome);
  correction.iterations = outcome.iterations;
  if (correction.code == CorrectionCode::kOk) {
    CheckSolution(target, point.p_TP, payload, conditions, theta, correction);
  }
}

bool Corrector::LeavesTooMuch(kinematics::Orientation orientation, double residual_rad) const {
  return orientation == kinematics::Orientation::kNearest &&
         residual_rad > limits_.max_rotation_rad;
}

bool Corrector::Extrapolates(const model::JointVector& q, const loads::Payload& payload,
                             const effects::Conditions& conditions) const {
  return arm_.LacksColumn(conditions) ||
         arm_.growth().Outside(arm_.PointAt(q, payload, conditions));
}

void Corrector::CheckSolution(const kinematics::PoseTarget& target, const Vec3& p_TP,
                              const loads::Payload& payload, const effects::Conditions& conditions,
                              const model::JointVector& theta, Correction& correction) const {
  using kinematics::Orientation;
  const Pose& X_BP = target.X_BT;
  deflection::LoadedState state;
  arm_.AtActual(theta, payload, conditions, state);
  const Pose X_BP_reached = PointOfTip(state.X_BT, p_TP);
  const bool free = target.orientation == Orientation::kFree;
  correction.residual_m = (X_BP.p - X_BP_reached.p).norm();
  correction.residual_rad = free ? 0 : AngleBetween(X_BP.R, X_BP_reached.R);
  correction.q = theta - state.sag;
  correction.X_BP_command = PointOfTip(arm_.UnloadedTip(correction.q, payload.tool), p_TP);
  // What the arm leaves of the orientation is that of the loaded tip.
  const Mat3& R_target = target.orientation == Orientation::kFixed ? X_BP.R : X_BP_reached.R;
  correction.translation_B = correction.X_BP_command.p - X_BP.p;
  correction.rotation_B = VectorFromRotation(correction.X_BP_command.R * R_target.transpose());
  correction.extrapolated = Extrapolates(correction.q, payload, conditions);

  kinematics::Jacobian jacobian;
  arm_.chain().JacobianAt(state.posture, X_BP_reached.p, jacobian);
  kinematics::OrientRows(target, X_BP_reached.R, jacobian);
  correction.singular_value = kinematics::SmallestSingularValue(jacobian, target.rows());
  if (!arm_.chain().WithinLimits(correction.q)) {
    correction.code = CorrectionCode::kJointLimit;
  } else if (LeavesTooMuch(target.orientation, correction.residual_rad)) {
    correction.code = CorrectionCode::kUnreachable;
  } else if (correction.singular_value < limits_.min_singular_value) {
    correction.code = CorrectionCode::kSingular;
  } else if (correction.translation_B.norm() > limits_.max_translation_m ||
             correction.rotation_B.norm() > limits_.max_rotation_rad) {
    correction.code = CorrectionCode::kTooLarge;
  }
}

void Corrector::PredictLanding(const Pose& X_BP, const Vec3& p_TP, const loads::Payload& payload,
                               const effects::Conditions& conditions,
                               const model::JointVector& seed, BranchSearch search,
                               Correction& landing) const {
  if (arm_.torques_missing()) {
    landing.code = CorrectionCode::kTorquesUnknown;
    return;
  }
  const auto unloaded_point = [&](const model::JointVector& q, kinematics::Posture& posture) {
    arm_.chain().Evaluate(q, posture);
    return PointOfTip(posture.X_BF() * arm_.X_FT(payload.tool), p_TP);
  };
  kinematics::InverseOutcome outcome;
  landing.code =
      Solve(arm_.chain(), {X_BP, orientation_}, unloaded_point, seed, search, landing.q, outcome);
  landing.iterations = outcome.iterations;
  if (landing.code != CorrectionCode::kOk) return;
  deflection::LoadedState state;
  if (!arm_.AtCommanded(landing.q, payload, conditions, state)) {
    landing.code = CorrectionCode::kNotConverged;
    return;
  }
  landing.X_BP_command = PointOfTip(state.X_BT, p_TP);
  landing.translation_B = landing.X_BP_command.p - X_BP.p;
  const Mat3 R_unloaded = arm_.UnloadedTip(landing.q, payload.tool).R;  // X_BP.R, if reachable
  landing.rotation_B = VectorFromRotation(landing.X_BP_command.R * R_unloaded.transpose());
  landing.extrapolated = Extrapolates(landing.q, payload, conditions);
  landing.residual_m = outcome.residual_m;
  landing.residual_rad = AngleBetween(X_BP.R, R_unloaded);
  if (LeavesTooMuch(orientation_, landing.residual_rad)) {
    landing.code = CorrectionCode::kUnreachable;
  }
}

}  // namespace plumbline::correction
