// Fit of trial shapes to a residual.
#pragma once

#include <utility>
#include <vector>

#include "app/measure/diagnosis/linear/linear_problem.h"

namespace plumbline::measure {

/// Reduction of chi2 by fitting columns to a residual.
/// @param columns  whitened, not yet projected
double Gain(const LinearProblem& problem, Eigen::MatrixXd columns, const Eigen::VectorXd& residual);

/// Value of a function of the conditions at each row of the problem.
template <typename F>
Eigen::VectorXd SignalAtRows(const LinearProblem& problem, const F& f) {
  Eigen::VectorXd values(problem.rows().count());
  for (const FitRowIndex j : problem.rows().indices()) {
    values[j.value()] = f(problem.data().conditions[problem.rows()[j]]);
  }
  return values;
}

/// Three consecutive entries of the influence: a translation along x, y and z.
std::vector<int> TranslationEntries(int first);

/// Blocks, each with its reduction of chi2.
using Found = std::vector<std::pair<double, Block>>;

/// The `most` blocks with the largest reduction, best first; ties in the order found.
std::vector<Block> Best(Found found, std::size_t most);

}  // namespace plumbline::measure
