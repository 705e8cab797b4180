#include "app/measure/diagnosis/residual_layout.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace plumbline::measure {

Vec3 LengthsOf(const RowResidual& residual) {
  Vec3 lengths = Vec3::Zero();
  const auto count = std::min<Eigen::Index>(residual.size(), 3);
  lengths.head(count) = residual.head(count);
  return lengths;
}

double SizeOf(const RowNumbers& numbers, const RowResidual& residual) {
  return std::sqrt(SquareOf(numbers, residual));
}

double SquareOf(const RowNumbers& numbers, const RowResidual& residual) {
  if (numbers.covariance.size() == 0) return residual.squaredNorm();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(numbers.covariance);
  return cholesky.matrixL().solve(residual).squaredNorm();
}

}  // namespace plumbline::measure
