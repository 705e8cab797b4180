// The declared model: where the tip of the loaded arm really is.
#pragma once

#include "firmware-like/beam/tip_compliance.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline {

/// The loaded arm in one posture.
struct LoadedState {
  Posture posture;              ///< frames of the sagged arm in B
  JointVector tau;              ///< gravity torques [N m]
  JointVector sag;              ///< joint deflections s = compliance tau [rad]
  Vec3 bend_F = Vec3::Zero();   ///< tip displacement of the tool in F [m]
  Vec3 slope_F = Vec3::Zero();  ///< rotation vector of the tip section in F [rad]
  Pose X_BT;                    ///< the loaded tip
};

/// Joint and tool deflection of a cell under gravity.
///   theta_i = sign_i (q_i + s_i) + offset_i,  s_i = compliance_i tau_i(q + s)
///   X_BT = X_BF(q + s) * (R = exp(slope_F), p = tcp_F + bend_F)
/// The tool bends as a small-displacement beam under the payload's force F = m g, its moment about
/// the tip M = (cog - tip of the straight tool) x F, and its own weight. Valid for bend/length
/// below 0.05. The torques are those of formats.md, "The declared model, exactly".
class LoadedArm {
 public:
  /// @param cell  as the configuration reader has checked it
  explicit LoadedArm(const CellModel& cell);

  const Chain& chain() const { return chain_; }
  const GravityLoads& loads() const { return loads_; }
  const Pose& X_WB() const { return X_WB_; }
  const Pose& X_FT() const { return X_FT_; }  ///< of the unloaded tool
  int size() const { return chain_.size(); }

  /// True where joints yield but torques cannot be computed, because a link's mass is not declared.
  bool torques_missing() const { return compliant_ && !loads_.known(); }

  /// The arm whose joints *really* stand at theta = q + s: no iteration is needed, and the
  /// command that leads there is theta - state.sag. Allocates nothing.
  void AtActual(const JointVector& theta, const Payload& payload, LoadedState& state) const;

  /// The arm that was *commanded* to q; solves theta = q + s(theta) to 1e-12 rad.
  /// @return false where the fixed point was not reached (an arm softer than any real one)
  [[nodiscard]] bool AtCommanded(const JointVector& q, const Payload& payload,
                                 LoadedState& state) const;

  /// Tip of the same arm without load and deflection: what the controller believes.
  Pose UnloadedTip(const JointVector& q) const;

 private:
  Chain chain_;
  GravityLoads loads_;
  TipCompliance tip_compliance_;
  Pose X_WB_, X_FT_;
  Vec3 g_B_;
  Vec3 beam_tip_F_;  ///< (0, 0, length): where the payload's moment is taken
  bool bends_;
  bool compliant_ = false;
  JointVector compliance_;
};

/// The cell with the base and tip of one session; the cell itself where it knows no sessions, and
/// the last session where `id` is not among them.
CellModel CellOfSession(const CellModel& cell, const std::string& id);

}  // namespace plumbline
