// Normal equations of observations in groups: parameters common to all groups, and each group's
// own.
#pragma once

#include <Eigen/Cholesky>

namespace plumbline::statistics {

/// J^T J and J^T r of one group, beside those of the common parameters, H x = -g.
/// @tparam kOwn, kCommon  numbers of parameters, or Eigen::Dynamic
template <int kOwn, int kCommon>
struct GroupEquations {
  using Factor = Eigen::LDLT<Eigen::Matrix<double, kOwn, kOwn>>;
  using OwnVector = Eigen::Matrix<double, kOwn, 1>;
  using CommonVector = Eigen::Matrix<double, kCommon, 1>;

  Eigen::Matrix<double, kOwn, kOwn> A;     ///< of the own parameters
  Eigen::Matrix<double, kOwn, kCommon> B;  ///< of own and common parameters
  OwnVector a;

  /// Eliminates the own parameters from the equations of the common ones (Schur complement).
  /// @param damping  of Levenberg and Marquardt, relative to the diagonal of A
  /// @return         the damped A, for Step()
  Factor Eliminate(Eigen::Matrix<double, kCommon, kCommon>& H, CommonVector& g,
                   double damping = 0) const {
    Eigen::Matrix<double, kOwn, kOwn> damped = A;
    damped.diagonal() *= 1 + damping;
    Factor factor(damped);
    H -= B.transpose() * factor.solve(B);
    g -= B.transpose() * factor.solve(a);
    return factor;
  }

  /// Step of the own parameters for a step of the common ones.
  OwnVector Step(const Factor& factor, const CommonVector& common) const {
    return -factor.solve(a + B * common);
  }
};

}  // namespace plumbline::statistics
