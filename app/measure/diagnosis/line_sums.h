// Fourier sums over unequally spaced angles.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace plumbline::measure {

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

}  // namespace plumbline::measure
