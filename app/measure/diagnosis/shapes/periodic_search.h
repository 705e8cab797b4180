// Shape searches for the cycles and phase of effects that are periodic in a joint angle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/linear/shape_search.h"

namespace plumbline::measure {

// Spectrum of a residual along the angle of one joint.

// Fourier sums over unequally spaced angles.

/// Sums over the rows of w sin(c q) and w cos(c q) at equally spaced cycles c, for fixed angles q
/// and any weights w: the nonuniform fast Fourier transform of type 1 [Greengard & Lee, SIAM
/// Review 46 (2004) 443]. Each row is spread over a grid of twice the resolution by a Gaussian;
/// the relative error is about 1e-11 of the sum of |w|.
class LineSums {
 public:
  /// @param q      angles of the rows [rad]
  /// @param first  first number of cycles per turn
  /// @param step   between successive ones
  /// @param steps  number of sums, at least 1
  LineSums(const Eigen::VectorXd& q, double first, double step, Eigen::Index steps);

  /// Sums with sin and with cos, shape (steps, 2).
  Eigen::ArrayX2d Of(const Eigen::VectorXd& weights) const;

 private:
  static constexpr int kSpread = 12;  ///< grid points on either side of a row

  Eigen::Index steps_;
  int grid_ = 0;               ///< number of grid points on the circle
  std::vector<int> start_;     ///< first grid point of each row
  Eigen::ArrayXXd spread_;     ///< weights of its grid points, shape (2 kSpread, rows)
  Eigen::ArrayXcd turned_;     ///< exp(-i c q) of each row at the middle of the cycles
  Eigen::ArrayXd correction_;  ///< of each sum, for the width of the Gaussian
};

/// Fits of sin(c q) and cos(c q) of one joint to residuals: what depends on the rows only, computed
/// once per problem.
class JointLines {
 public:
  static constexpr double kMinCycles = 0.5, kMaxCycles = 400;
  /// Cycles per turn of an eccentric and of an elliptical gear: lines that need no search.
  static constexpr std::array kWholeCycles = {1.0, 2.0};

  JointLines(const LinearProblem& problem, int joint);
  /// Those of a problem, computed on first use.
  static const JointLines& Of(const LinearProblem& problem, int joint);

  /// Difference of the cycles per turn of lines that a joint resolves within this range.
  static double ResolutionOf(double span_rad);

  /// False if the joint moves too little to separate any lines.
  bool moved() const { return scan_.has_value(); }
  /// Number of lines that can be resolved.
  double resolvable() const;

  /// A residual as the fits need it.
  Eigen::VectorXd Along(const Eigen::VectorXd& residual) const;
  /// The strongest lines, located to a third of the resolution, nuisances not projected out. Empty
  /// unless the joint moved().
  std::vector<PeriodicLine> Peaks(const Eigen::VectorXd& along) const;
  /// Reduction of chi2 by one of the whole cycles, with the nuisances projected out.
  double GainOfWhole(std::size_t number, const Eigen::VectorXd& along) const;
  /// The line with its gain, nuisances projected out.
  PeriodicLine WithGain(PeriodicLine line, const Eigen::VectorXd& along) const;
  /// The line at the highest gain near it, with its amplitude.
  /// @param line  with its gain
  PeriodicLine Refined(PeriodicLine line, const Eigen::VectorXd& along) const;
  /// The highest share of its gain that refinement adds to a line from Peaks().
  static constexpr double kLostByScan = 0.2;

  /// Differences of cycles at which two lines cannot be distinguished: the maxima of the spectral
  /// window of the rows, |sum_i w_i exp(i c q_i)| / sum_i w_i with the squared carrier as weight,
  /// beyond the resolution of the range itself.
  std::vector<double> IndistinctShifts() const;

 private:
  static constexpr int kHalvings = 6;

  /// Sine and cosine of multiples of the angle of each row, shape (rows, 2).
  using Waves = Eigen::ArrayX2d;
  /// The coarse scan over all cycles.
  struct Scan {
    LineSums sums;
    Eigen::ArrayX2d twice;  ///< sums of the squared carrier over the double angle
  };

  double resolution() const { return ResolutionOf(span_rad_); }
  Waves WavesAt(double cycles) const;
  double GainOf(const Waves& waves, const Eigen::VectorXd& along) const;
  std::vector<double> GainsAlong(const Eigen::VectorXd& along) const;
  Eigen::ArrayXd SpectralWindow(double first, double step, Eigen::Index steps) const;

  const CarriedColumns& carried_;
  int joint_;
  double span_rad_, carrier_length_;
  Eigen::VectorXd q_;  ///< in the order of carried_
  Eigen::VectorXd square_;
  double step_ = 0;  ///< of the scan, cycles per turn
  std::optional<Scan> scan_;
  std::array<Waves, kHalvings> turns_;  ///< by the steps of the refinement
  std::array<Waves, kWholeCycles.size()> whole_;
  std::array<Eigen::MatrixXd, kWholeCycles.size()> whole_grams_;
};

/// For `gear_periodic`: amplitude sin(cycles q + phase) as a sine and a cosine column, which makes
/// the phase linear. Proposes the best cycles per turn over all joints, from 0.5 to 400, and one
/// and two cycles (eccentricity and ellipticity) on every joint. Excludes two lines on one joint
/// that its range of angles cannot resolve.
const ShapeSearch& GearPeriodicSearch();

/// For `counterbalance`: one cycle on the second joint, which carries the spring or gas cylinder of
/// heavy arms. Fixed columns for sine and cosine; nothing is searched.
const ShapeSearch& CounterbalanceSearch();

/// The strongest spectral lines of a residual along each joint angle.
/// @param residual  whitened and projected
std::vector<PeriodicLine> PeriodicLines(const LinearProblem& problem,
                                        const Eigen::VectorXd& residual);

/// Cycles per turn, from 0.5 to 400 and ascending, of lines that the rows cannot distinguish from
/// this one because the readings of its joint are equally spaced (line_aliases.h).
std::vector<double> AliasedCycles(const LinearProblem& problem, const PeriodicLine& line);

/// True if the range of the joint does not resolve two of its lines. Lines at whole cycles are
/// exempt: they are an eccentricity and its harmonics, not one line split in two.
bool Unresolved(const LinearProblem& problem, const PeriodicLine& a, const PeriodicLine& b);

/// The block of a line with other cycles per turn, of the same joint and number of trials.
Block LineAt(const Block& line, double cycles);

}  // namespace plumbline::measure
