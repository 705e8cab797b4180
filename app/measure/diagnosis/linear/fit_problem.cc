#include "app/measure/diagnosis/linear/fit_problem.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "app/measure/diagnosis/linear/nuisances.h"

namespace plumbline::measure {

FitLayout FitProblem::layout() const {
  FitLayout layout;
  for (const RowIndex row : rows) layout.Add(data.numbers[row].count);
  layout.Add(Nuisances(data).equations());
  return layout;
}

FitProblem UnitWeightFit(const Dataset& data, int threads) {
  PerRow<double> weights;
  for (const RowNumbers& of_row : data.numbers) weights.push_back(of_row.count > 0 ? 1 : 0);
  return {data, EveryRow(data), std::move(weights), data.sigma_m, threads};
}

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
