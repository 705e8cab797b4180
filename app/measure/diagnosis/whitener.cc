#include "app/measure/diagnosis/whitener.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace plumbline::measure {

RowWhitening::RowWhitening(const RowNumbers& numbers, double factor) : factor_(factor) {
  if (numbers.covariance.size() == 0) return;
  const Eigen::LLT<Eigen::MatrixXd> cholesky(numbers.covariance);
  matrix_ = factor * Eigen::MatrixXd::Identity(numbers.count, numbers.count);
  cholesky.matrixL().solveInPlace(matrix_);
}

RowWhitening RowWhitening::Times(double factor) const {
  RowWhitening times = *this;
  times.factor_ *= factor;
  times.matrix_ *= factor;
  return times;
}

Whitener::Whitener(const FitProblem& problem) {
  rows_.reserve(problem.rows.size());
  for (const RowIndex row : problem.rows) {
    rows_.emplace_back(problem.data.numbers[row],
                       std::sqrt(problem.weights[row]) / problem.sigma_m);
  }
}

}  // namespace plumbline::measure
