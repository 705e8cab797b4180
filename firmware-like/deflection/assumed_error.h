// Landing error due to undeclared parameters, sampled from their priors.
#pragma once

#include "firmware-like/deflection/load_statement.h"
#include "firmware-like/deflection/priors.h"

namespace plumbline {

/// The error of the declared model's tip as a Monte Carlo sample of fixed random numbers, so that
/// the same posture always has the same radius. For each draw d of all parameters p
///   tau_j   = sum_l m_l z_j . (r_l - o_j) x g + payload        torque with the masses drawn
///   e       = sum_j J_j (c_j tau_j - c_j^0 tau_j^0)            joints, ^0 as the model has them
///           + bend(load) - bend(load^0) + root tilt + base tilt + instrument
/// first order in the deflections. Parameters are drawn from:
///   undeclared joints, links, coupling, pedestal    priors.h
///   declared joints and tool                        `deflection_sd` of the deflection itself
///   stated payload        5 % + 0.1 kg; its centre 20 mm + 10 % of its distance from the flange
///   (RMS in space) unstated payload      0 to 1.1 rated payloads, uniform; its centre at the tip,
///   50 mm + 30 % of
///                         the tool's length
///   instrument            its sigma, 0.05 mm where none is declared
/// Covers deflection, load and instrument; not the geometry of the unloaded arm, nor what a cell
/// could declare and the model cannot hold.
/// Latin hypercube draws; the radius repeats to about 2 % for other draws.
class AssumedError {
 public:
  AssumedError(const CellModel& cell, const LoadedArm& arm, double deflection_sd);

  struct Estimate {
    double radius_m = 0;          ///< holds 95 % of the draws
    double undeclared_share = 0;  ///< of the mean square error, by what only priors describe
  };
  /// Allocates nothing; costs some tens of microseconds.
  /// @param state         the loaded arm in the posture asked for, of the same arm
  /// @param covariance_W  of the effects' parameters [m^2]; see EffectCovariance
  /// @param p_TP          the tool point in the tip's frame [m]
  Estimate At(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
            const Conditions& conditions, const Vec3& p_TP, const Mat3& covariance_W);

  const DeflectionPriors& priors() const { return priors_; }

 private:
  static constexpr int kDraws = 512;
  using Row = Eigen::Array<double, 1, kDraws>;
  using Rows = Eigen::Array<double, Eigen::Dynamic, kDraws, Eigen::RowMajor>;
  using Errors = Eigen::Array<double, 3, kDraws, Eigen::RowMajor>;
  /// A load as the joints feel it: its mass, and mass times centre in F.
  using Load = Eigen::Array<double, 4, kDraws, Eigen::RowMajor>;

  void DrawLoad(const LoadedArm& arm, const LoadStatement& load);
  void AddJoints(const LoadedArm& arm, const LoadedState& state, const Vec3& p_B, const Vec3& g_B);
  void AddTool(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
               const Vec3& p_TP, const Vec3& g_F);
  void AddBase(const LoadedArm& arm, const LoadedState& state, const LoadStatement& load,
               const Vec3& p_B, const Vec3& g_B);

  DeflectionPriors priors_;
  JointVector declared_;  ///< compliances [rad/(N m)]; 0 where none is declared
  double instrument_sd_m_;

  // Drawn once. Normal numbers but for compliance_, mass_change_, root_tilt_, base_.
  Rows compliance_;   ///< a row a joint: compliance where it is not declared, else 0
  Rows share_;        ///< a row a joint: error of a declared sag, as a share of it
  Rows mass_change_;  ///< a row a link: drawn minus modelled mass [kg]
  Rows centre_;       ///< a row a link: along com_sd_L
  Rows load_;         ///< mass proportional, mass constant, three of the centre
  Row rated_;         ///< payload that the arm is built for [kg]
  Row uniform_, bend_share_, root_tilt_, base_;
  Errors normal_, covered_;  ///< of the instrument, of the effects' covariance

  // Of the call under way.
  Influence<double> influence_;  ///< of the cell's effects
  Load load_change_;
  Row torque_;
  Errors undeclared_, declared_error_;
  Row square_;
};

}  // namespace plumbline
