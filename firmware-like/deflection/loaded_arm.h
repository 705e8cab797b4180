// The model: where the tip of the loaded arm really is, declared deflections and effects together.
#pragma once

#include "firmware-like/beam/tip_compliance.h"
#include "firmware-like/deflection/distance_growth.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline {

/// What bends the tool in one posture, effects included: enough to tell every section of it.
template <typename T>
struct ToolLoadOf {
  Vec3Of<T> g_F = Vec3Of<T>::Zero();  ///< gravity in the flange frame [m/s^2]
  PayloadOf<T> payload;
  T bend_factor = T(1);                  ///< the declared beam's bending times this
  T shear = T(0);                        ///< 1/kappa of shear that the beam does not declare
  Vec3Of<T> root_F = Vec3Of<T>::Zero();  ///< rotation vector of the tool's seat [rad]
};

/// The loaded arm in one posture.
template <typename T>
struct LoadedStateOf {
  PostureOf<T> posture;                   ///< frames of the sagged arm in B
  JointVectorOf<T> tau;                   ///< gravity torques [N m]
  JointVectorOf<T> sag;                   ///< joint deflections s [rad], effects included
  Vec3Of<T> bend_F = Vec3Of<T>::Zero();   ///< tip displacement of the tool in F [m]
  Vec3Of<T> slope_F = Vec3Of<T>::Zero();  ///< rotation vector of the tip section in F [rad]
  ToolLoadOf<T> tool;                     ///< what these two come from
  PoseOf<T> X_WT;                         ///< the loaded tip in W, as the instrument is aligned
  /// The tip as the instrument reads it, its own errors included [m]. An instrument of ranges reads
  /// no tip: its errors act on the measured length, and this is the tip itself.
  Vec3Of<T> p_read_W = Vec3Of<T>::Zero();
};

struct LoadedState : LoadedStateOf<double> {
  Pose X_BT;  ///< the loaded tip in the *declared* base, whatever effects do to the base
};

/// Joint and tool deflection of a cell under gravity, and what its effects add.
///   theta_i = sign_i (q_i + s_i) + offset_i
///   s_i = c_i (tau_i + torque_i) - hardening_i tau_i^3 + gap_i sign(tau_i) + share_i |tau_i| +
///   turn_i X_WT = X_WB * lean * X_BF(q + s) * (R = exp(slope_F), p = tcp_F + bend_F + tip_F)
///   p_read = (1 + scale) (c + R_WC K(R_WC^T (p_WT - c))), c and R_WC the measuring camera, if any;
///   p_read = p_WT where ranges are measured
///   K(p) = (1 + camera_scale) ((1 - k1 r^2) X, (1 - k1 r^2) Y, (1 + depth) (1 - 2 k1 r^2) Z)
///   lean = exp(pedestal_compliance * moment of the leaning arm's weight about B's origin)
/// Bearings that tilt, links that bend and twist and slides that bend (structure.h) move the tip of
/// that arm, from the outermost joint inwards: rigid motions of what is outboard, small, under the
/// weight in the posture without them. A tilted base turns about its origin, W's axes fixed:
///   X_WB = exp(tilt_x, tilt_y, 0) R(roll, pitch, yaw)
/// The tool bends as a small-displacement beam under the payload's force F = m g, its moment about
/// the tip M = (cog - tip of the straight tool) x F, and its own weight. Valid for bend/length
/// below 0.05. The torques are those of formats.md, "The declared model, exactly"; effects see the
/// measured torques where there are any.
class LoadedArm {
 public:
  /// @param cell  as the configuration reader has checked it
  explicit LoadedArm(const CellModel& cell);

  const Chain& chain() const { return chain_; }
  const GravityLoads& loads() const { return loads_; }
  const Pose& X_WB() const { return X_WB_; }
  const Pose& X_FT() const { return X_FT_; }  ///< of the unloaded tool
  int size() const { return chain_.size(); }
  bool bends() const { return bends_; }
  /// Declared, without what effects add [rad/(N m)].
  double compliance(int joint) const { return compliance_[joint]; }
  /// True where a camera measures, whose pose is declared.
  bool read_by_camera() const { return X_WC_.has_value(); }
  /// True where ranges are measured: no error of the instrument moves `p_read_W`.
  bool read_by_range() const { return ranges_; }
  const TipCompliance& tip_compliance() const { return tip_compliance_; }
  const Vec3& beam_tip_F() const { return beam_tip_F_; }  ///< where a payload's moment is taken

  /// True where a joint yields, as declared or by an effect, but its torque is unknown: the mass of
  /// a link outwards of it is not declared.
  /// @param measured  torques are given with the conditions, so that effects need no masses
  bool torques_missing(bool measured = false) const {
    return torques_missing_ || (effect_torques_missing_ && !measured);
  }
  /// True where a joint yields to a link whose centre of mass is a guess.
  bool centres_guessed() const { return centres_guessed_; }

  const std::vector<ActiveEffect>& effects() const { return effects_; }
  /// What the distance from the fitted poses makes of the effects.
  const DistanceGrowth& growth() const { return growth_; }
  /// The sum of the cell's effects at `moment`, in the share that its distance from the fitted
  /// poses leaves. Allocates nothing.
  Influence<double> EffectsAt(const Conditions& moment) const;

  /// The arm whose joints *really* stand at theta = q + s: the command that leads there is
  /// theta - state.sag. Allocates nothing.
  /// @param conditions  what the cell's effects read; its q is found here
  void AtActual(const JointVector& theta, const Payload& payload, const Conditions& conditions,
                LoadedState& state) const;

  /// The arm that was *commanded* to q; solves theta = q + s(theta) to 1e-12 rad.
  /// @return false where the fixed point was not reached (an arm softer than any real one)
  [[nodiscard]] bool AtCommanded(const JointVector& q, const Payload& payload,
                                 const Conditions& conditions, LoadedState& state) const;

  /// The same with the effects already summed.
  [[nodiscard]] bool AtCommanded(const JointVector& q, const Payload& payload,
                                 const Influence<double>* influence,
                                 const JointVector& measured_tau,
                                 LoadedStateOf<double>& state) const;

  /// The equations themselves, at actual joint positions theta, for numbers of any type.
  /// @param influence     what effects add in this moment; null: nothing
  /// @param measured_tau  joint torques that effects see in place of the computed; may be empty
  template <typename T>
  void Equations(const JointVectorOf<T>& theta, const PayloadOf<T>& payload,
                 const Influence<T>* influence, const JointVector& measured_tau,
                 LoadedStateOf<T>& state) const;

  /// The tip moved with bearings and links that yield; g_B in B, in the posture of `state`.
  template <typename T>
  PoseOf<T> WithStructure(PoseOf<T> X_BT, const JointVectorOf<T>& theta,
                          const Influence<T>& influence, const Vec3Of<T>& g_B,
                          const LoadedStateOf<T>& state) const;

  /// Tip of the same arm without load and deflection: what the controller believes.
  Pose UnloadedTip(const JointVector& q) const;

  /// `conditions` at joints q, with what the cell declares filled in.
  Conditions MomentOf(const JointVector& q, const Conditions& conditions) const;

 private:
  Chain chain_;
  GravityLoads loads_;
  TipCompliance tip_compliance_;
  Pose X_WB_, X_FT_;
  Vec3 base_rpy_;
  Vec3 g_W_;
  Vec3 g_B_;
  Vec3 beam_tip_F_;           ///< (0, 0, length): where the payload's moment is taken
  double shear_m_per_N_ = 0;  ///< sum L / (G A) of the tool's segments
  bool bends_;
  bool torques_missing_ = false;
  bool effect_torques_missing_ = false;
  bool centres_guessed_ = false;
  JointVector compliance_;
  std::vector<ActiveEffect> effects_;
  DistanceGrowth growth_;
  std::optional<Pose> X_WC_;  ///< of a measuring camera
  bool ranges_;               ///< are measured, no positions
  Conditions declared_;
};

/// The cell with the base and tip of one session; the cell itself where it knows no sessions, and
/// the last session where `id` is not among them.
CellModel CellOfSession(const CellModel& cell, const std::string& id);

}  // namespace plumbline
