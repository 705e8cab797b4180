// Monte Carlo model of the tip error caused by undeclared parameters, sampled from their priors.
#pragma once

#include "firmware-like/deflection/load_statement.h"
#include "firmware-like/deflection/priors.h"

namespace plumbline::deflection {

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

}  // namespace plumbline::deflection
