// Forward model of the loaded arm: actual tip pose from joints, payload, declared deflections and
// effects.
#pragma once

#include "firmware-like/beam/tip_compliance.h"
#include "firmware-like/deflection/error_growth.h"
#include "firmware-like/effects/needed_columns.h"
#include "firmware-like/effects/written.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/gravity.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::deflection {

/// Loads on the tool in one posture, effects included; they determine the deflection of every
/// section.
template <typename T>
struct ToolStateInputOf {
  Vec3Of<T> g_F = Vec3Of<T>::Zero();  ///< gravity in the flange frame [m/s^2]
  loads::PayloadOf<T> payload;
  T bend_factor = T(1);                  ///< factor on the bending of the declared beam
  T shear = T(0);                        ///< 1/kappa of shear in addition to the declared beam
  Vec3Of<T> root_F = Vec3Of<T>::Zero();  ///< rotation vector of the flange coupling [rad]
};

/// State of the loaded arm in one posture.
template <typename T>
struct LoadedStateOf {
  kinematics::PostureOf<T> posture;  ///< frames of the deflected arm in B
  model::JointVectorOf<T> tau;       ///< gravity torques of the drives [N m]
  /// Joint deflections s, effects included, as changes of the joint values: D^-1 s [rad].
  model::JointVectorOf<T> sag;
  Vec3Of<T> bend_F = Vec3Of<T>::Zero();   ///< tip displacement of the tool in F [m]
  Vec3Of<T> slope_F = Vec3Of<T>::Zero();  ///< rotation vector of the tip section in F [rad]
  ToolStateInputOf<T> tool;               ///< the loads that cause bend_F and slope_F
  PoseOf<T> X_WT;                         ///< pose of the loaded tip in W
  /// Tip position reported by the instrument, including its own errors [m]. For ranges this is the
  /// tip itself, because the errors of such an instrument act on the measured length.
  Vec3Of<T> p_read_W = Vec3Of<T>::Zero();
};

struct LoadedState : LoadedStateOf<double> {
  Pose X_BT;  ///< pose of the loaded tip in the *declared* base, even if effects move the base
};

/// Tip of the longest tool in the flange frame: its joints displace it most.
const Vec3& FarthestTip_F(const model::CellModel& cell);

/// Joint and tool deflection of a cell under gravity, together with its effects.
///   theta_i = sign_i (C q + E s)_i + offset_i           C = E D: model::JointCoupling
///   s_i     = c_i (tau_i + torque_i) - hardening_i tau_i^3 + gap_i sign(tau_i) + share_i |tau_i|
///             + turn_i
///   X_WT    = X_WB * lean * X_BF(q + s) * (R = exp(slope_F), p = tcp_F + bend_F + tip_F)
///   p_read  = (1 + scale) (c + R_WC K(R_WC^T (p_WT - c))), with c and R_WC of the measuring
///   camera;
///             p_WT for ranges
///   K(p)    = (1 + camera_scale) ((1 - k1 r^2) X, (1 - k1 r^2) Y, (1 + depth) (1 - 2 k1 r^2) Z)
///   lean    = exp(pedestal_compliance * moment of the leaning arm's weight about the origin of B)
/// Tilting bearings, bending and twisting links, and bending slides (structure.h) are small rigid
/// motions of everything outboard. They are applied from the outermost joint inwards and computed
/// from the weight in the posture without them. A tilted base rotates about its origin, about the
/// axes of W:
///   X_WB = exp(tilt_x, tilt_y, 0) R(roll, pitch, yaw)
/// The tool bends as a small-displacement beam under the payload's force F = m g, its moment about
/// the tip M = (cog - tip of the undeflected tool) x F, and its own weight. Valid for bend/length <
/// 0.05. The torques are defined in docs/reference/files.md, "The declared model"; effects use
/// measured torques if available.
class LoadedArm {
 public:
  /// @param cell  validated by the configuration reader
  explicit LoadedArm(const model::CellModel& cell);

  const kinematics::Chain& chain() const { return chain_; }
  const loads::GravityLoads& loads() const { return loads_; }
  const Pose& X_WB() const { return X_WB_; }
  /// Tip of the unloaded tool. Tools are given by their index, see CellModel::ToolAt.
  const Pose& X_FT(int tool = 0) const { return Tool(tool).X_FT; }
  int size() const { return chain_.size(); }
  int tools() const { return static_cast<int>(tools_.size()); }
  bool bends(int tool = 0) const { return Tool(tool).bends; }
  /// Declared compliance, without effects [rad/(N m)] or [m/N].
  double compliance(int joint) const { return compliance_[joint]; }
  /// True if the tip is measured by a camera with a declared pose.
  bool read_by_camera() const { return X_WC_.has_value(); }
  /// True if ranges are measured; `p_read_W` then contains no error of the instrument.
  bool read_by_range() const { return ranges_; }
  const beam::TipCompliance& tip_compliance(int tool = 0) const { return Tool(tool).compliance; }
  /// Reference point of payload moments: (0, 0, length).
  const Vec3& beam_tip_F(int tool = 0) const { return Tool(tool).beam_tip_F; }

  /// True if a joint is compliant, as declared or because of an effect, but its torque is unknown
  /// because the mass of a link outboard of it is not declared.
  /// @param measured  the conditions include measured torques, so effects need no masses
  bool torques_missing(bool measured = false) const {
    return torques_missing_ || (effect_torques_missing_ && !measured);
  }
  /// True if a compliant joint carries a link whose centre of mass is not declared.
  bool centres_guessed() const { return centres_guessed_; }

  const std::vector<effects::ActiveEffect>& effects() const { return effects_; }
  /// Columns that the effects need in addition to posture and load.
  const std::vector<effects::NeededColumn>& needed_columns() const { return needed_columns_; }
  /// True if an effect adds nothing because such a column is missing; its state is then unknown.
  bool LacksColumn(const effects::Conditions& conditions) const;
  /// Growth of the error, and fading of the effects, with the distance from the fitted rows.
  const ErrorGrowth& growth() const { return growth_; }
  /// The sum of the cell's effects under the conditions `moment`, times the share that applies at
  /// their distance from the fitted rows. Does not allocate.
  effects::Influence<double> EffectsAt(const effects::Conditions& moment,
                                       const loads::Payload& payload) const;
  /// The conditions and the load at one instant, as the growth of the error takes them: the payload
  /// that is stated, even if the cell cannot use its mass, and the gravity torques of the
  /// undeflected arm without effects. Does not allocate.
  OperatingPoint PointAt(const model::JointVector& q, const loads::Payload& payload,
                         const effects::Conditions& conditions) const;

  /// State of the arm at *actual* joint positions theta = q + D^-1 s. The command that leads there
  /// is theta - state.sag. Does not allocate.
  /// @param conditions  inputs of the cell's effects; q is determined here
  void AtActual(const model::JointVector& theta, const loads::Payload& payload,
                const effects::Conditions& conditions, LoadedState& state) const;

  /// State of the arm *commanded* to q; solves theta = q + D^-1 s(theta) to 1e-12 rad by
  /// fixed-point iteration.
  /// @return false if the iteration does not converge (an arm softer than any real one)
  [[nodiscard]] bool AtCommanded(const model::JointVector& q, const loads::Payload& payload,
                                 const effects::Conditions& conditions, LoadedState& state) const;

  /// The same with the effects already accumulated; null if there are none.
  [[nodiscard]] bool AtCommanded(const model::JointVector& q, const loads::Payload& payload,
                                 const effects::Influence<double>* influence,
                                 const model::JointVector& measured_tau,
                                 LoadedStateOf<double>& state) const;

  /// The model equations at actual joint positions theta, for double and dual numbers.
  /// @param influence     accumulated effects; null if there are none
  /// @param measured_tau  measured joint torques, used by effects instead of computed ones; may be
  ///                      empty
  template <typename T>
  void Equations(const model::JointVectorOf<T>& theta, const loads::PayloadOf<T>& payload,
                 const effects::Influence<T>* influence, const model::JointVector& measured_tau,
                 LoadedStateOf<T>& state) const;

  /// The tip pose including tilting bearings and bending links, in the posture of `state`.
  /// @param g_B  gravity in B [m/s^2]
  template <typename T>
  PoseOf<T> WithStructure(PoseOf<T> X_BT, const model::JointVectorOf<T>& theta,
                          const effects::Influence<T>& influence, const Vec3Of<T>& g_B,
                          const LoadedStateOf<T>& state) const;

  /// Tip pose in B without load and deflection, as computed by the controller.
  Pose UnloadedTip(const model::JointVector& q, int tool = 0) const;

  /// Copy of `conditions` with the drives' positions at q and the values declared by the cell
  /// filled in.
  effects::Conditions ConditionsAt(const model::JointVector& q,
                                   const effects::Conditions& conditions) const;

 private:
  struct ToolModel {
    explicit ToolModel(const model::Tool& tool);
    beam::TipCompliance compliance;
    Pose X_FT;
    Vec3 beam_tip_F;
    double shear_m_per_N = 0;  ///< sum L / (G A) of the segments
    bool bends;
  };
  const ToolModel& Tool(int tool) const { return tools_[tool]; }

  kinematics::Chain chain_;
  loads::GravityLoads loads_;
  std::vector<ToolModel> tools_;
  Pose X_WB_;
  Vec3 base_rpy_;
  Vec3 g_W_;
  Vec3 g_B_;
  bool torques_missing_ = false;
  bool effect_torques_missing_ = false;
  bool centres_guessed_ = false;
  model::JointVector compliance_;
  std::vector<effects::ActiveEffect> effects_;
  std::vector<effects::NeededColumn> needed_columns_;
  ErrorGrowth growth_;
  std::optional<Pose> X_WC_;  ///< pose of the measuring camera
  bool ranges_;               ///< ranges are measured, not positions
  effects::Conditions declared_;
};

/// The cell with base and tips of one session, which predicts the measured rows of that session.
/// The cell is returned unchanged if it has no sessions; an unknown `id` selects the last session.
/// A tool that the session did not measure has the tip of the last session that did.
model::CellModel CellOfSession(const model::CellModel& cell, const std::string& id);

/// Sets the tips that a session states; the others stay.
void ApplyTips(const model::SessionFrames& session, model::CellModel& cell);

/// The number by which a session states the tip of a tool; nullopt if the cell has only one.
std::optional<int> SessionTipNumber(const model::CellModel& cell, int tool);

/// The cell by which points are corrected, without sessions. Base and tip are as declared: those
/// estimated for a session describe where the instrument and its target were mounted. Only if the
/// points are in the instrument's frame (Measurement::holds_points), the base is that of the last
/// session.
model::CellModel CellOfPoints(const model::CellModel& cell);

}  // namespace plumbline::deflection
