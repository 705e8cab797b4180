// Columns of empirical terms: carriers, polynomials of recorded signals, and fits of nested
// columns.
#pragma once

#include <utility>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linear_problem.h"

namespace plumbline::measure {

/// Legendre polynomial P_degree of x in -1..1.
inline double Legendre(int degree, double x) {
  double previous = 1, current = x;
  if (degree == 0) return 1;
  for (int k = 1; k < degree; ++k) {
    const double next = ((2 * k + 1) * x * current - k * previous) / (k + 1);
    previous = current;
    current = next;
  }
  return current;
}

/// A value of the signal scaled so that its range over the rows is -1..1.
inline double Scaled(const RecordedSignal& signal, double value) {
  return 2 * (value - signal.low) / (signal.high - signal.low) - 1;
}

using SignalPair = std::pair<SignalIndex, SignalIndex>;

/// The influences that an unknown cause may act on: base, tip, bending of the tool, joints, and the
/// lengths of links of at least 50 mm, which change slowly (a link that warms up).
std::vector<std::vector<int>> Carriers(const Dataset& data);

/// False for the length of a link with a signal of a joint, which moves much faster than it
/// changes.
bool MayFollow(const std::vector<int>& carrier, const RecordedSignal& signal);

/// Polynomial degrees to try; limited by the number of distinct values of the signal.
std::vector<int> Degrees(const RecordedSignal& signal, std::size_t carriers);

/// True if the carrier is a frame that the measurement leaves free.
bool IsFreeFrame(const Dataset& data, const std::vector<int>& carrier);

/// Legendre polynomials of a signal, degrees 0..last.
/// @param rows  of the problem, in any order
Eigen::MatrixXd Polynomials(const LinearProblem& problem, const std::vector<FitRowIndex>& rows,
                            SignalIndex signal, int last);

/// Products of the polynomials of two signals, as in a surface.
Eigen::MatrixXd SurfaceFactors(const LinearProblem& problem, const std::vector<FitRowIndex>& rows,
                               const SignalPair& pair, int degree, bool with_constant);

/// Fits of the first 1, 2, .. columns to any residual, from one Cholesky factorisation of their
/// Gram matrix; columns that depend linearly on earlier ones are skipped.
class NestedFits {
 public:
  explicit NestedFits(const Eigen::MatrixXd& gram);

  int Rank(std::size_t last) const { return rank_[last]; }
  /// Reduction of chi2 by the columns 0..last, for each `last`.
  /// @param moments  products of the columns with the residual
  std::vector<double> Gains(const Eigen::VectorXd& moments) const;

 private:
  Eigen::MatrixXd L_;
  std::vector<int> kept_, rank_;
};

}  // namespace plumbline::measure
