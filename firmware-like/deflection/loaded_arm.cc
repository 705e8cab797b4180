#include "firmware-like/deflection/loaded_arm.h"

#include <algorithm>

#include "firmware-like/geometry/rotation.h"

namespace plumbline {

LoadedArm::LoadedArm(const CellModel& cell)
    : chain_(cell.robot),
      loads_(cell),
      tip_compliance_(TipComplianceOf(cell.tool)),
      X_WB_(cell.robot.X_WB),
      X_FT_{Mat3::Identity(), cell.tool.tcp_F},
      g_B_(cell.robot.X_WB.R.transpose() * cell.robot.g_W),
      beam_tip_F_(0, 0, cell.tool.Length()),
      bends_(!cell.tool.rigid),
      compliance_(chain_.size()) {
  for (int i = 0; i < chain_.size(); ++i) {
    compliance_[i] =
        cell.robot.joints[static_cast<std::size_t>(i)].compliance_rad_per_Nm.value_or(0.0);
    compliant_ = compliant_ || compliance_[i] != 0;
  }
}

void LoadedArm::AtActual(const JointVector& theta, const Payload& payload,
                         LoadedState& state) const {
  chain_.Evaluate(theta, state.posture);
  loads_.Torques(state.posture, g_B_, payload, state.tau);
  state.sag = compliance_.cwiseProduct(state.tau);
  const Pose& X_BF = state.posture.X_BF();
  Pose X_FT = X_FT_;
  if (bends_) {
    const Vec3 g_F = X_BF.R.transpose() * g_B_;
    const Vec3 force_F = payload.mass_kg * g_F;
    const Vec3 moment_F = (payload.cog_F - beam_tip_F_).cross(force_F);
    const Vec6 bend = tip_compliance_.Bend(force_F, moment_F, g_F);
    state.bend_F = bend.head<3>();
    state.slope_F = bend.tail<3>();
    X_FT.p += state.bend_F;
    X_FT.R = RotationFromVector(state.slope_F);
  }
  state.X_BT = X_BF * X_FT;
}

bool LoadedArm::AtCommanded(const JointVector& q, const Payload& payload,
                            LoadedState& state) const {
  JointVector theta = q;
  for (int pass = 0; pass < 50; ++pass) {
    AtActual(theta, payload, state);
    const double change = (q + state.sag - theta).cwiseAbs().maxCoeff();
    if (!compliant_ || change < 1e-12) return true;
    theta = q + state.sag;
  }
  return false;
}

Pose LoadedArm::UnloadedTip(const JointVector& q) const {
  Posture posture;
  chain_.Evaluate(q, posture);
  return posture.X_BF() * X_FT_;
}

CellModel CellOfSession(const CellModel& cell, const std::string& id) {
  CellModel of_session = cell;
  if (cell.sessions.empty()) return of_session;
  const auto known = std::find_if(cell.sessions.begin(), cell.sessions.end(),
                                  [&](const SessionFrames& session) { return session.id == id; });
  const SessionFrames& frames = known == cell.sessions.end() ? cell.sessions.back() : *known;
  of_session.robot.X_WB = frames.X_WB;
  if (frames.tip_F) of_session.tool.tcp_F = *frames.tip_F;
  return of_session;
}

}  // namespace plumbline
