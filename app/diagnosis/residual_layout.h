// How many residuals each row has, how uncertain they are, and where they lie in vectors of all
// rows.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "app/diagnosis/indices.h"
#include "firmware-like/geometry/pose.h"

namespace plumbline::diagnosis {

/// A measured pose has six: three of its position and three of its orientation.
inline constexpr int kMaxResiduals = 6;

/// Those of a row that are lengths come first, at most so many.
inline constexpr int kMostLengths = 3;

/// One row's residuals, measured minus predicted: position or range [m] first, then orientation
/// as a rotation vector [rad]. Shape (0..6).
using RowResidual = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxResiduals, 1>;

/// What one row measures.
struct RowNumbers {
  /// Of its residuals: 0 (joints alone), 1 (a range), 3 (a position) or 6 (a pose).
  int count = 0;
  /// Covariance of the residuals over the squared noise of the fit (one axis): 1, or [rad^2/m^2]
  /// of an orientation. Shape (count, count), positive definite; empty: the unit matrix.
  Eigen::MatrixXd covariance;

  /// Those that are lengths.
  int lengths() const { return std::min(count, kMostLengths); }
};

/// A row's residual in space: that of its position; of a range (r, 0, 0); zero where nothing was
/// measured [m].
Vec3 LengthsOf(const RowResidual& residual);

/// The residual in units of its standard uncertainty, times the fit's noise:
/// sqrt(r^T covariance^-1 r) [m].
double SizeOf(const RowNumbers& numbers, const RowResidual& residual);
/// Its square [m^2].
double SquareOf(const RowNumbers& numbers, const RowResidual& residual);

/// Where the residuals of each row lie in a vector of all of them, in the order of the rows.
template <typename Index>
class ResidualLayout {
 public:
  void Add(int count) { first_.push_back(total() + count); }

  int first(Index row) const { return first_[row.offset()]; }
  int count(Index row) const { return first_[row.offset() + 1] - first(row); }
  int total() const { return first_.back(); }

  /// The part of a stacked vector or matrix, shape (total, ..), that belongs to a row.
  template <typename Stacked>
  auto PartOf(Stacked&& stacked, Index row) const {
    return std::forward<Stacked>(stacked).middleRows(first(row), count(row));
  }

 private:
  std::vector<int> first_ = {0};
};

using RowLayout = ResidualLayout<RowIndex>;
using FitLayout = ResidualLayout<FitRowIndex>;

}  // namespace plumbline::diagnosis
