#include "firmware-like/deflection/landing_uncertainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <unsupported/Eigen/SpecialFunctions>
#include <vector>

#include "firmware-like/deflection/linear_range.h"
#include "firmware-like/deflection/priors.h"
#include "firmware-like/effects/event_time_uncertainty.h"
#include "firmware-like/statistics/random_sequence.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::deflection {
// Monte Carlo model of the tip error caused by undeclared parameters, sampled from their priors.

/// Samples the error of the declared model's tip with a fixed set of random numbers, so that the
/// same posture always has the same radius. For each draw of all parameters,
///   tau_j   = sum_l m_l z_j . (r_l - o_j) x g + payload        torque with the drawn masses
///   e       = sum_j J_j (c_j tau_j - c_j^0 tau_j^0)            joints; ^0: values of the model
///           + bend(load) - bend(load^0) + root tilt + base tilt + instrument
/// to first order in the deflections. The parameters are drawn from:
///   undeclared joints, links, coupling, pedestal    the priors in priors.h
///   declared joints and tool    `deflection_sd`, a fraction of the deflection
///   stated payload              mass 5 % + 0.1 kg; centre of gravity 20 mm + 10 % of its distance
///                               from the flange (RMS distance in space)
///   unstated payload            mass uniform from 0 to 1.1 times the rated payload; centre of
///                               gravity at the tip, 50 mm + 30 % of the tool's length
///   instrument                  its sigma, or 0.05 mm if undeclared
/// Covers deflection, load and instrument, but neither the geometry of the unloaded arm nor effects
/// that the model cannot represent.
/// The draws form a Latin hypercube; with other draws the radius varies by about 2 %.
class AssumedError {
 public:
  AssumedError(const model::CellModel& cell, const LoadedArm& arm, double deflection_sd);

  struct Estimate {
    double radius_m = 0;          ///< contains 95 % of the draws
    double undeclared_share = 0;  ///< of the mean square error, due to undeclared parameters
  };
  /// Error of the tool point in one posture. Does not allocate; takes some tens of microseconds.
  /// @param state         the loaded arm in this posture; must come from `arm`
  /// @param covariance_W  tip covariance due to the effects' parameters [m^2], see EffectCovariance
  /// @param p_TP          tool point in the tip frame [m]
  Estimate At(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
              const effects::Conditions& conditions, const Vec3& p_TP, const Mat3& covariance_W);

  const DeflectionPriors& priors() const { return priors_; }

 private:
  static constexpr int kDraws = 512;
  using Row = Eigen::Array<double, 1, kDraws>;
  using Rows = Eigen::Array<double, Eigen::Dynamic, kDraws, Eigen::RowMajor>;
  using Errors = Eigen::Array<double, 3, kDraws, Eigen::RowMajor>;
  /// Mass, and first moment in F, of a load.
  using Load = Eigen::Array<double, 4, kDraws, Eigen::RowMajor>;

  void DrawLoad(const LoadedArm& arm, const LoadStatement& load);
  /// Adds `share` times the torque error about axis j to `torque_`.
  void AddTorque(const LoadedArm& arm, const kinematics::Posture& posture, const Vec3& g_B, int j,
                 double share);
  void AddJoints(const LoadedArm& arm, const LoadedState& state, const Vec3& p_B, const Vec3& g_B);
  void AddTool(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
               const Vec3& p_TP, const Vec3& g_F);
  void AddBase(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
               const Vec3& p_B, const Vec3& g_B);

  DeflectionPriors priors_;
  model::JointVector declared_;  ///< compliances [rad/(N m)]; 0 where none is declared
  double instrument_sd_m_;

  // Drawn once. Standard normal, except compliance_, mass_change_, rated_, uniform_, root_tilt_,
  // base_.
  Rows compliance_;   ///< a row per joint: compliance if undeclared, else 0 [rad/(N m)]
  Rows share_;        ///< a row per joint: relative error of a declared deflection
  Rows mass_change_;  ///< a row per link: drawn minus modelled mass [kg]
  Rows centre_;       ///< a row per link: centre of mass along com_sd_L
  Rows load_;         ///< payload: mass proportional, mass constant, centre of gravity x, y, z
  Row rated_;         ///< rated payload [kg]
  Row uniform_, bend_share_, root_tilt_, base_;
  Errors normal_, covered_;  ///< for the instrument, and for the covariance of the effects

  // Scratch memory of At().
  effects::Influence<double> influence_;  ///< of the cell's effects
  Load load_change_;
  Row torque_;
  Errors undeclared_, declared_error_;
  Row square_;
};

namespace {

constexpr double kUndeclaredInstrument_m = 5e-5;
constexpr double kConfidence = 0.95;

/// Fills a row with one quantile from each of equally likely strata, in random order: one column of
/// a Latin hypercube [McKay, Beckman & Conover, Technometrics 21 (1979) 239].
template <typename Derived>
void Stratify(statistics::RandomSequence& random, Eigen::ArrayBase<Derived>& row) {
  const auto count = static_cast<std::size_t>(row.size());
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t k = count; k > 1; --k) std::swap(order[k - 1], order[random.Below(k)]);
  for (std::size_t k = 0; k < count; ++k) {
    row(static_cast<Eigen::Index>(k)) =
        (static_cast<double>(order[k]) + 0.5) / static_cast<double>(count);
  }
}

template <typename Derived>
void DrawNormal(statistics::RandomSequence& random, Eigen::ArrayBase<Derived>&& row) {
  Stratify(random, row);
  for (Eigen::Index k = 0; k < row.size(); ++k) row(k) = Eigen::numext::ndtri(row(k));
}

template <typename Rows>
void DrawNormals(statistics::RandomSequence& random, Rows& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) DrawNormal(random, rows.row(i));
}

}  // namespace

AssumedError::AssumedError(const model::CellModel& cell, const LoadedArm& arm, double deflection_sd)
    : priors_(PriorsOf(cell, arm)),
      declared_(model::JointVector::Zero(arm.size())),
      instrument_sd_m_(cell.measurement.sigma_m.value_or(kUndeclaredInstrument_m)) {
  const int n = arm.size();
  for (Rows* rows : {&compliance_, &share_, &mass_change_, &centre_}) {
    rows->setZero(n, Eigen::NoChange);
  }
  load_.setZero(5, Eigen::NoChange);

  statistics::RandomSequence random(2);
  Row common;
  DrawNormal(random, common.row(0));
  DrawNormal(random, rated_.row(0));
  const Row size = (priors_.rated_sigma_ln * rated_).exp();
  // Sigma of ln: 0.4 without link masses; with them, the payload's share of T_2 leaves 0.2.
  constexpr double kRatedSigma_ln = 0.2;
  rated_ =
      priors_.rated_payload_kg * (std::max(kRatedSigma_ln, priors_.rated_sigma_ln) * rated_).exp();
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    declared_[i] = cell.robot.joints[k].compliance_rad_per_Nm.value_or(0.0);
    DrawNormal(random, share_.row(i));
    DrawNormal(random, centre_.row(i));
    DrawNormal(random, compliance_.row(i));
    DrawNormal(random, mass_change_.row(i));
    if (const auto& prior = priors_.compliance[k]) {
      const double common_sd = std::min(priors_.common_sigma_ln, prior->sigma_ln);
      const double own_sd = std::sqrt(prior->sigma_ln * prior->sigma_ln - common_sd * common_sd);
      compliance_.row(i) =
          prior->median * (common_sd * common + own_sd * compliance_.row(i)).exp() / size;
    } else {
      compliance_.row(i).setZero();
    }
    const DeflectionPriors::Link& link = priors_.links[k];
    if (link.mass_sigma_ln > 0) {
      mass_change_.row(i) = link.mass_kg * size * (link.mass_sigma_ln * mass_change_.row(i)).exp();
    } else {
      mass_change_.row(i).setZero();
    }
  }
  share_ *= deflection_sd;
  DrawNormals(random, load_);
  Stratify(random, uniform_);
  DrawNormal(random, bend_share_.row(0));
  DrawNormal(random, root_tilt_.row(0));
  DrawNormal(random, base_.row(0));
  DrawNormals(random, normal_);
  DrawNormals(random, covered_);
  bend_share_ *= deflection_sd;
  const auto log_normal = [](const std::optional<LogNormal>& prior, Row& row) {
    if (prior) {
      row = prior->median * (prior->sigma_ln * row).exp();
    } else {
      row.setZero();
    }
  };
  log_normal(priors_.root_tilt_rad, root_tilt_);
  log_normal(priors_.base_compliance_rad_per_Nm, base_);
}

void AssumedError::DrawLoad(const LoadedArm& arm, const LoadStatement& load) {
  constexpr double kMassShare = 0.05, kMass_kg = 0.1;
  constexpr double kCentre_m = 0.02, kCentreShare = 0.1;
  constexpr double kUnstatedCentre_m = 0.05, kUnstatedCentreShare = 0.3;
  constexpr double kLargestShareOfRated = 1.1;  // arms are sometimes overloaded
  auto mass = load_change_.row(0);
  if (load.mass_kg) {
    mass = *load.mass_kg * (1 + kMassShare * load_.row(0)) + kMass_kg * load_.row(1);
    mass = mass.max(0.0);
  } else {
    mass = kLargestShareOfRated * rated_ * uniform_;
  }
  const Vec3 tip_F = arm.X_FT(load.modelled.tool).p;
  const Vec3 centre_F = load.centre_stated ? load.modelled.cog_F : tip_F;
  // RMS distance in space; each axis gets a third of its square.
  const double distance_sd_m = load.centre_stated
                                   ? kCentre_m + kCentreShare * centre_F.norm()
                                   : kUnstatedCentre_m + kUnstatedCentreShare * tip_F.norm();
  const double sd_m = distance_sd_m / std::sqrt(3.0);
  for (int axis = 0; axis < 3; ++axis) {
    load_change_.row(1 + axis) = mass * (centre_F[axis] + sd_m * load_.row(2 + axis)) -
                                 load.modelled.mass_kg * load.modelled.cog_F[axis];
  }
  mass -= load.modelled.mass_kg;
}

void AssumedError::AddTorque(const LoadedArm& arm, const kinematics::Posture& posture,
                             const Vec3& g_B, int j, double share) {
  const auto k = static_cast<std::size_t>(j);
  const Pose& X_BF = posture.X_BF();
  const Vec3 axis = share * posture.axis_B[k];
  if (arm.chain().type(j) != model::JointType::kRevolute) {
    const double along = axis.dot(g_B);
    for (int l = j; l < arm.size(); ++l) torque_ += along * mass_change_.row(l);
    torque_ += along * load_change_.row(0);
    return;
  }
  // Torque about the axis per unit mass at r; linear, so each mass contributes one product.
  const auto torque = [&](const Vec3& r_B) { return axis.dot(r_B.cross(g_B)); };
  for (int l = j; l < arm.size(); ++l) {
    const DeflectionPriors::Link& link = priors_.links[l];
    const Pose& X_BL = posture.X_BL[l];
    if (link.mass_sigma_ln > 0) {
      torque_ += torque(X_BL * link.com_L - posture.point_B[k]) * mass_change_.row(l);
    }
    if (!link.com_shift_L.isZero(0)) torque_ += link.mass_kg * torque(X_BL.R * link.com_shift_L);
    if (!link.com_sd_L.isZero(0)) {
      torque_ += link.mass_kg * torque(X_BL.R * link.com_sd_L) * centre_.row(l);
    }
  }
  torque_ += torque(X_BF.p - posture.point_B[k]) * load_change_.row(0);
  for (int a = 0; a < 3; ++a) torque_ += torque(X_BF.R.col(a)) * load_change_.row(1 + a);
}

void AssumedError::AddJoints(const LoadedArm& arm, const LoadedState& state, const Vec3& p_B,
                             const Vec3& g_B) {
  using I = effects::Influence<double>;
  const kinematics::Posture& posture = state.posture;
  kinematics::Jacobian jacobian;
  arm.chain().DriveJacobianAt(posture, p_B, jacobian);
  for (int j = 0; j < arm.size(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    const Vec3 lever = jacobian.col(j).head<3>();
    const bool prior = priors_.compliance[k].has_value();
    const double tau = state.tau[j];
    // ds / dtau of a joint whose compliance is declared, by the file or by an effect.
    const double slope = declared_[j] + influence_.Joint(I::kCompliance, j) -
                         3 * influence_.Joint(I::kHardening, j) * tau * tau;
    if (!prior && slope == 0) continue;
    torque_.setConstant(0);
    AddTorque(arm, posture, g_B, j, 1);
    for (const model::JointCoupling& coupling : arm.chain().couplings()) {
      if (coupling.of == j && coupling.drive == model::CouplingDrive::kReading) {
        AddTorque(arm, posture, g_B, coupling.joint, coupling.ratio);
      }
    }
    // From torque to deflection error; a joint with a prior has no deflection in the model.
    if (prior) {
      torque_ = compliance_.row(j) * (tau + torque_);
    } else {
      torque_ *= slope;
    }
    // The relative error applies only to what the file declares; effects have their own covariance.
    const double declared_sag = declared_[j] * tau;
    for (int a = 0; a < 3; ++a) {
      undeclared_.row(a) += lever[a] * torque_;
      declared_error_.row(a) += (lever[a] * declared_sag) * share_.row(j);
    }
  }
}

void AssumedError::AddTool(const LoadedArm& arm, const LoadedState& state,
                           const LoadStatement& load, const Vec3& p_TP, const Vec3& g_F) {
  const Mat3& R_BF = state.posture.X_BF().R;
  if (arm.bends(load.modelled.tool)) {
    const beam::TipCompliance& tip = arm.tip_compliance(load.modelled.tool);
    const double factor = state.tool.bend_factor;
    const auto bend = [&](const Vec3& force_F, const Vec3& moment_F) -> Vec3 {
      const Vec6 both =
          tip.C_wrench.leftCols<3>() * force_F + tip.C_wrench.rightCols<3>() * moment_F;
      return factor * (R_BF * both.head<3>());
    };
    const Vec3 by_mass = bend(g_F, (-arm.beam_tip_F(load.modelled.tool)).cross(g_F));
    const Vec3 declared =
        R_BF * (state.bend_F - state.tool.root_F.cross(arm.X_FT(load.modelled.tool).p));
    for (int a = 0; a < 3; ++a) {
      undeclared_.row(a) += by_mass[a] * load_change_.row(0);
      declared_error_.row(a) += declared[a] * bend_share_;
    }
    for (int c = 0; c < 3; ++c) {
      const Vec3 by_centre = bend(Vec3::Zero(), Vec3::Unit(c).cross(g_F));
      for (int a = 0; a < 3; ++a) undeclared_.row(a) += by_centre[a] * load_change_.row(1 + c);
    }
  }
  if (!priors_.root_tilt_rad) return;
  // The coupling is sized for its usual load, at least a quarter of the rated payload.
  constexpr double kSmallestShare = 0.25;
  const double usual_kg = std::max(load.mass_kg.value_or(load.modelled.mass_kg),
                                   kSmallestShare * priors_.rated_payload_kg);
  const double centre_m =
      load.centre_stated ? load.modelled.cog_F.norm() : arm.X_FT(load.modelled.tool).p.norm();
  const double sized_Nm =
      g_F.norm() * (usual_kg * centre_m + arm.loads().tool_body_kg_m(load.modelled.tool).norm());
  if (sized_Nm <= 0) return;
  const Vec3 modelled_kg_m =
      load.modelled.mass_kg * load.modelled.cog_F + arm.loads().tool_body_kg_m(load.modelled.tool);
  for (int axis = 0; axis < 2; ++axis) {  // the coupling does not twist
    torque_.setConstant(modelled_kg_m.cross(g_F)[axis]);
    for (int c = 0; c < 3; ++c) {
      torque_ += Vec3::Unit(c).cross(g_F)[axis] * load_change_.row(1 + c);
    }
    torque_ *= root_tilt_ / sized_Nm;
    const Vec3 shift_B = R_BF * Vec3::Unit(axis).cross(arm.X_FT(load.modelled.tool).p + p_TP);
    for (int a = 0; a < 3; ++a) undeclared_.row(a) += shift_B[a] * torque_;
  }
}

void AssumedError::AddBase(const LoadedArm& arm, const LoadedState& state,
                           const LoadStatement& load, const Vec3& p_B, const Vec3& g_B) {
  if (!priors_.base_compliance_rad_per_Nm) return;
  const kinematics::Posture& posture = state.posture;
  Vec3 moment_kg_m = Vec3::Zero();
  for (int l = 0; l < arm.size(); ++l) {
    const auto k = static_cast<std::size_t>(l);
    moment_kg_m += priors_.links[k].mass_kg * (posture.X_BL[k] * priors_.links[k].com_L);
  }
  const double load_kg = load.modelled.mass_kg + load_change_.row(0).mean();
  moment_kg_m += (load_kg + arm.loads().tool_mass_kg(load.modelled.tool)) * state.X_BT.p;
  const Vec3 shift_per_rad = moment_kg_m.cross(g_B).cross(p_B);
  for (int a = 0; a < 3; ++a) undeclared_.row(a) += shift_per_rad[a] * base_;
}

AssumedError::Estimate AssumedError::At(const LoadedArm& arm, const LoadedState& state,
                                        const LoadStatement& load,
                                        const effects::Conditions& conditions, const Vec3& p_TP,
                                        const Mat3& covariance_W) {
  influence_ = arm.EffectsAt(conditions, load.modelled);
  const Vec3 p_B = state.X_BT * p_TP;
  const Vec3& g_F = state.tool.g_F;
  const Vec3 g_B = state.posture.X_BF().R * g_F;
  undeclared_.setZero();
  declared_error_ = instrument_sd_m_ * normal_;
  if (!covariance_W.isZero(0)) {
    // Expressed in B: rotating all error contributions together does not change their length.
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(arm.X_WB().R.transpose() * covariance_W *
                                                    arm.X_WB().R);
    for (int c = 0; c < 3; ++c) {
      const Vec3 shift =
          eigen.eigenvectors().col(c) * std::sqrt(std::max(0.0, eigen.eigenvalues()[c]));
      for (int a = 0; a < 3; ++a) declared_error_.row(a) += shift[a] * covered_.row(c);
    }
  }
  DrawLoad(arm, load);
  AddJoints(arm, state, p_B, g_B);
  AddTool(arm, state, load, p_TP, g_F);
  AddBase(arm, state, load, p_B, g_B);

  square_ = undeclared_.square().colwise().sum();
  const double undeclared = square_.mean();
  square_ = (undeclared_ + declared_error_).square().colwise().sum();
  const double all = square_.mean();
  const auto place = static_cast<std::ptrdiff_t>(std::ceil(kConfidence * kDraws)) - 1;
  std::nth_element(square_.data(), square_.data() + place, square_.data() + kDraws);
  return {std::sqrt(square_[static_cast<Eigen::Index>(place)]), all > 0 ? undeclared / all : 0};
}

/// Share of the mean square error beyond which the radius grows by more than a tenth: 1 - 1 /
/// 1.1^2.
constexpr double kShareThatMatters = 0.17;

/// Covariance for conditions that may lie before or after an event, because the event's time is
/// uncertain: the displacement caused by the event must lie within the 95 % radius.
Mat3 CovarianceOfUncertainEvents(const LoadedArm& arm, const model::JointVector& q,
                                 const loads::Payload& payload,
                                 const effects::Conditions& conditions) {
  constexpr double kZ = 1.959964;
  Mat3 covariance = Mat3::Zero();
  for (const effects::ActiveEffect& effect : arm.effects()) {
    const auto uncertainty = effects::UncertaintyOfEventTime(effect, conditions);
    if (!uncertainty) continue;
    effects::Conditions before = conditions, after = conditions;
    (uncertainty->is_row ? before.row : before.t_s) = uncertainty->between.low;
    (uncertainty->is_row ? after.row : after.t_s) = uncertainty->between.high;
    LoadedState earlier, later;
    if (!arm.AtCommanded(q, payload, before, earlier)) continue;
    if (!arm.AtCommanded(q, payload, after, later)) continue;
    const Vec3 moved_W = (later.p_read_W - earlier.p_read_W) / kZ;
    covariance += moved_W * moved_W.transpose();
  }
  return covariance;
}

/// Covariance for conditions that lack a column of an effect: the displacement caused by the effect
/// over its fitted range must lie within the 95 % radius.
Mat3 CovarianceOfMissingColumns(const LoadedArm& arm, const model::JointVector& q,
                                const loads::Payload& payload,
                                const effects::Conditions& conditions, const LoadedState& state) {
  constexpr double kZ = 1.959964;
  Mat3 covariance = Mat3::Zero();
  for (const effects::NeededColumn& needed : arm.needed_columns()) {
    if (!needed.MissingFrom(conditions)) continue;
    Vec3 farthest_W = Vec3::Zero();
    for (const double value : {needed.range.low, needed.range.high}) {
      LoadedState other;
      const auto moment = effects::WithColumn(conditions, needed.column, value);
      if (!arm.AtCommanded(q, payload, moment, other)) continue;
      const Vec3 moved_W = other.p_read_W - state.p_read_W;
      if (moved_W.norm() > farthest_W.norm()) farthest_W = moved_W;
    }
    covariance += farthest_W * farthest_W.transpose() / (kZ * kZ);
  }
  return covariance;
}

LandingUncertainty::LandingUncertainty(const model::CellModel& cell, const LoadedArm& arm,
                                       const model::DeclaredDeviation& deviation)
    : fitted_(cell.domain.has_value()),
      as_validated_(fitted_ && cell.domain->as_validated),
      held_out_(fitted_ && cell.domain->residual_sigma_m.has_value()),
      tested_(held_out_ && !arm.read_by_range()),
      deviation_stated_(deviation.stated),
      covariance_share_(fitted_ ? cell.domain->covariance_share : 1),
      residual_sigma_m_(held_out_ ? *cell.domain->residual_sigma_m
                                  : cell.measurement.sigma_m.value_or(0.0)),
      assumed_(std::make_unique<AssumedError>(cell, arm, deviation.share)),
      scratch_(arm) {}

LandingUncertainty::~LandingUncertainty() = default;
LandingUncertainty::LandingUncertainty(LandingUncertainty&&) noexcept = default;

model::StatedRadius LandingUncertainty::At(const LoadedArm& arm, const model::JointVector& q,
                                           const LoadStatement& load,
                                           const effects::Conditions& conditions, bool extrapolated,
                                           const Vec3& p_TP) {
  if (!arm.AtCommanded(q, load.modelled, conditions, state_)) return {};
  const Mat3 effects_W =
      covariance_share_ * EffectCovariance(arm, q, load.modelled, conditions, scratch_) +
      CovarianceOfUncertainEvents(arm, q, load.modelled, conditions) +
      CovarianceOfMissingColumns(arm, q, load.modelled, conditions, state_);
  if (!fitted_) return Assumed(arm, q, load, conditions, p_TP, effects_W);
  const OperatingPoint point = arm.PointAt(q, load.modelled, conditions);
  const double grown_m2 = held_out_ ? arm.growth().Variance(point) : 0;
  const double variance_m2 = residual_sigma_m_ * residual_sigma_m_ + grown_m2;
  const Mat3 covariance = effects_W + variance_m2 * Mat3::Identity();
  const model::RadiusBasis basis =
      tested_ ? model::RadiusBasis::kMeasured : model::RadiusBasis::kPropagated;
  const model::StatedRadius inside{statistics::RadiusHolding95Percent(covariance),
                                   as_validated_ ? basis : model::RadiusBasis::kAssumed};
  if (!extrapolated && as_validated_) return inside;
  if (RestsOnGrowth(arm, load, point))
    return {inside.radius_m, model::Weakest(inside.basis, model::RadiusBasis::kAssumed)};
  const model::StatedRadius outside = Assumed(arm, q, load, conditions, p_TP, Mat3::Zero());
  return {std::hypot(inside.radius_m, outside.radius_m),
          model::Weakest(inside.basis, outside.basis)};
}

bool LandingUncertainty::RestsOnGrowth(const LoadedArm& arm, const LoadStatement& load,
                                       const OperatingPoint& point) const {
  return fitted_ && as_validated_ && load.mass_kg && arm.growth().Describes(point);
}

model::StatedRadius LandingUncertainty::Assumed(const LoadedArm& arm, const model::JointVector& q,
                                                const LoadStatement& load,
                                                const effects::Conditions& conditions,
                                                const Vec3& p_TP, const Mat3& covariance_W) {
  const effects::Conditions moment = arm.ConditionsAt(q, conditions);
  const AssumedError::Estimate error = assumed_->At(arm, state_, load, moment, p_TP, covariance_W);
  const double radius_m = error.radius_m + NeglectedByLinearTheory(arm, state_);
  if (!assumed_->priors().complete) return {radius_m, model::RadiusBasis::kUnknown};
  const bool propagated = deviation_stated_ && error.undeclared_share < kShareThatMatters;
  return {radius_m, propagated ? model::RadiusBasis::kPropagated : model::RadiusBasis::kAssumed};
}

}  // namespace plumbline::deflection
