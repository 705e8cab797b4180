// Equations of the loaded arm as templates of the number type. Include only where they are
// instantiated.
#pragma once

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/deflection/structure.h"

namespace plumbline::deflection {

/// exp([v]x) to third order. For rotations of milliradians the truncation error is below 1e-12.
template <typename T>
Mat3Of<T> SmallRotation(const Vec3Of<T>& v) {
  const T zero(0);
  Mat3Of<T> K;
  K << zero, -v.z(), v.y(), v.z(), zero, -v.x(), -v.y(), v.x(), zero;
  const Mat3Of<T> K2 = K * K;
  return Mat3Of<T>::Identity() + K + 0.5 * K2 + (K * K2) / 6.0;
}

template <typename T>
Mat3Of<T> RotationFromRpy(const Vec3Of<T>& rpy) {
  using std::cos, std::sin;
  const T cr = cos(rpy[0]), sr = sin(rpy[0]), cp = cos(rpy[1]), sp = sin(rpy[1]);
  const T cy = cos(rpy[2]), sy = sin(rpy[2]);
  Mat3Of<T> R;
  R << cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,  //
      sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,   //
      -sp, cp * sr, cp * cr;
  return R;
}

/// False if both the value and its derivatives are zero.
inline bool IsActive(double value) {
  return value != 0;
}
template <int kWidth>
bool IsActive(const ceres::Jet<double, kWidth>& value) {
  return value.a != 0 || !value.v.isZero(0);
}

/// Position in W that a camera at X_WC with the errors in `influence` reports for a point; see
/// effects/instrument_effects.h. Unchanged if the point is not in front of the camera.
template <typename T>
Vec3Of<T> ReadByCamera(const Pose& X_WC, const effects::Influence<T>& influence,
                       const Vec3Of<T>& p_W) {
  using I = effects::Influence<T>;
  const Mat3Of<T> R = X_WC.R.cast<T>();
  const Vec3Of<T> c = X_WC.p.cast<T>();
  Vec3Of<T> p_C = R.transpose() * (p_W - c);
  if (!(p_C[2] > T(0))) return p_W;
  const T bend =
      influence[I::kCameraRadial] * (p_C[0] * p_C[0] + p_C[1] * p_C[1]) / (p_C[2] * p_C[2]);
  const T beside = (1.0 + influence[I::kCameraScale]) * (1.0 - bend);
  const T along =
      (1.0 + influence[I::kCameraScale]) * (1.0 + influence[I::kCameraDepth]) * (1.0 - 2.0 * bend);
  p_C[0] *= beside;
  p_C[1] *= beside;
  p_C[2] *= along;
  return c + R * p_C;
}

/// Applies the structural deflections of all joints to X_BT, from the outermost joint inwards.
template <typename T>
PoseOf<T> LoadedArm::WithStructure(PoseOf<T> X_BT, const model::JointVectorOf<T>& theta,
                                   const effects::Influence<T>& influence, const Vec3Of<T>& g_B,
                                   const LoadedStateOf<T>& state) const {
  loads::OutboardMassesOf<T> outboard;
  model::JointVectorOf<T> tau;
  loads_.Torques(state.posture, g_B, state.tool.payload, tau, &outboard);
  const model::JointVectorOf<T> axes = chain_.AxisPositions<T>(theta);
  for (int i = size() - 1; i >= 0; --i) {
    const auto motions = StructureMotions<T>(chain_, state.posture, outboard, g_B, i, axes[i]);
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const auto entry =
          static_cast<typename effects::Influence<T>::JointEntry>(kStructureEntries[k]);
      const T& size = influence.Joint(entry, i);
      const Mat3Of<T> R = SmallRotation<T>(size * motions[k].turn);
      X_BT.p = motions[k].centre + R * (X_BT.p - motions[k].centre) + size * motions[k].shift;
      X_BT.R = R * X_BT.R;
    }
  }
  return X_BT;
}

template <typename T>
void LoadedArm::Equations(const model::JointVectorOf<T>& theta, const loads::PayloadOf<T>& payload,
                          const effects::Influence<T>* influence,
                          const model::JointVector& measured_tau, LoadedStateOf<T>& state) const {
  using I = effects::Influence<T>;
  PoseOf<T> X_WB{X_WB_.R.cast<T>(), X_WB_.p.cast<T>()};
  Vec3Of<T> g_B = g_B_.cast<T>();
  loads::PayloadOf<T> load = payload;
  if (influence != nullptr) {
    X_WB.R = RotationFromRpy<T>(base_rpy_.cast<T>() + influence->Vector(I::kBaseRollPitchYaw));
    const Vec3Of<T> tilt_W((*influence)[I::kBaseTilt], (*influence)[I::kBaseTilt + 1], T(0));
    X_WB.R = SmallRotation<T>(tilt_W) * X_WB.R;
    X_WB.p += influence->Vector(I::kBase);
    const Vec3Of<T> turn_W((*influence)[I::kGravityTurnX], (*influence)[I::kGravityTurnY], T(0));
    g_B = X_WB.R.transpose() * (SmallRotation<T>(turn_W) * g_W_.cast<T>());
    load.mass_kg += (*influence)[I::kPayloadMass];
    load.cog_F += influence->Vector(I::kPayloadCog);
  }

  if (influence == nullptr) {
    chain_.Evaluate<T>(theta, nullptr, state.posture);
  } else {
    const kinematics::DhChanges<T> changes{
        &influence->Joint(I::kLengthA, 0), &influence->Joint(I::kOffsetD, 0),
        &influence->Joint(I::kTwistAlpha, 0), &influence->Joint(I::kTwistBeta, 0)};
    chain_.Evaluate<T>(theta, &changes, state.posture);
  }
  Vec3Of<T> base_moment = loads_.Torques(state.posture, g_B, load, state.tau);
  // The arm leans with its pedestal. In the frame of the leaning arm, gravity has another
  // direction, which changes the torques, the bending and the moment that causes the lean. Each
  // pass reduces the error by a factor of the lean angle, which is milliradians.
  constexpr int kLeanPasses = 5;
  Vec3Of<T> lean = Vec3Of<T>::Zero();
  if (influence != nullptr && IsActive((*influence)[I::kPedestalCompliance])) {
    const Vec3Of<T> g_still_B = g_B;
    for (int pass = 0; pass < kLeanPasses; ++pass) {
      lean = (*influence)[I::kPedestalCompliance] * (SmallRotation<T>(lean) * base_moment);
      g_B = SmallRotation<T>(lean).transpose() * g_still_B;
      base_moment = loads_.Torques(state.posture, g_B, load, state.tau);
    }
  }
  state.sag.resize(size());
  for (int i = 0; i < size(); ++i) {
    T s = compliance_[i] * state.tau[i];
    if (influence != nullptr) {
      const T tau = measured_tau.size() > i ? T(measured_tau[i]) : state.tau[i];
      const T& softer = influence->Joint(I::kCompliance, i);
      const T& torque = influence->Joint(I::kTorque, i);
      s += softer * tau + (compliance_[i] + softer) * torque + influence->Joint(I::kTurn, i) -
           influence->Joint(I::kHardening, i) * tau * tau * tau;
      const T& share = influence->Joint(I::kLoadShare, i);
      if (tau > T(0)) s += influence->Joint(I::kLoadGap, i) + share * tau;
      if (tau < T(0)) s -= influence->Joint(I::kLoadGap, i) + share * tau;
    }
    state.sag[i] = s;
  }
  state.sag = chain_.ReportedFromDrives<T>(state.sag);

  const PoseOf<T>& X_BF = state.posture.X_BF();
  const ToolModel& tool = Tool(load.tool);
  PoseOf<T> X_FT{tool.X_FT.R.cast<T>(), tool.X_FT.p.cast<T>()};
  const Vec3Of<T> g_F = X_BF.R.transpose() * g_B;
  const Vec3Of<T> force_F = load.mass_kg * g_F;
  state.tool = {.g_F = g_F, .payload = load};
  if (tool.bends) {
    const beam::TipCompliance& tip = tool.compliance;
    const Vec3Of<T> moment_F = (load.cog_F - tool.beam_tip_F.cast<T>()).cross(force_F);
    Eigen::Matrix<T, 6, 1> bend = tip.C_wrench.leftCols<3>().cast<T>() * force_F +
                                  tip.C_wrench.rightCols<3>().cast<T>() * moment_F +
                                  tip.C_gravity.cast<T>() * g_F;
    if (influence != nullptr) {
      state.tool.bend_factor = 1.0 + (*influence)[I::kBendRatio];
      state.tool.shear = (*influence)[I::kShear];
      bend *= state.tool.bend_factor;
      const T shear = state.tool.shear * tool.shear_m_per_N;
      bend[0] += shear * force_F[0];
      bend[1] += shear * force_F[1];
    }
    state.bend_F = bend.template head<3>();
    state.slope_F = bend.template tail<3>();
  } else {
    state.bend_F.setZero();
    state.slope_F.setZero();
  }
  if (influence != nullptr) {
    const Vec3& tool_kg_m = loads_.tool_body_kg_m(load.tool);
    const Vec3Of<T> body_kg_m = tool_kg_m.cast<T>();
    Vec3Of<T> root = load.cog_F.cross(force_F) + body_kg_m.cross(g_F);
    root[2] = T(0);
    root *= (*influence)[I::kRootCompliance];
    state.tool.root_F = root;
    state.bend_F += root.cross(tool.X_FT.p.cast<T>());
    state.slope_F += root;
    X_FT.p += influence->Vector(I::kTip);
  }
  X_FT.p += state.bend_F;
  X_FT.R = SmallRotation<T>(state.slope_F);
  PoseOf<T> X_BT = X_BF * X_FT;
  if (influence != nullptr) {
    if (HasStructuralCompliance(*influence, size())) {
      X_BT = WithStructure<T>(X_BT, theta, *influence, g_B, state);
    }
    const Mat3Of<T> R = SmallRotation<T>(lean);
    X_BT = PoseOf<T>{R * X_BT.R, R * X_BT.p};
  }
  state.X_WT = X_WB * X_BT;
  state.p_read_W = state.X_WT.p;
  if (influence == nullptr) return;
  if (X_WC_) state.p_read_W = ReadByCamera(*X_WC_, *influence, state.p_read_W);
  if (!ranges_) state.p_read_W *= 1.0 + (*influence)[I::kScale];
}

}  // namespace plumbline::deflection
