// Spectrum of a residual along the angle of one joint.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/carried_columns.h"
#include "app/measure/diagnosis/line_sums.h"

namespace plumbline::measure {

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

}  // namespace plumbline::measure
