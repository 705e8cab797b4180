// How well trial shapes follow a residual.
#pragma once

#include <utility>
#include <vector>

#include "app/diagnosis/linear_problem.h"

namespace plumbline {

/// The drop of chi2 when columns are fitted to the residual.
/// @param columns  whitened, not yet projected
double Gain(const LinearProblem& problem, Eigen::MatrixXd columns, const Eigen::VectorXd& residual);

/// Value of a signal at each row of the problem.
template <typename F>
Eigen::VectorXd AtRows(const LinearProblem& problem, const F& f) {
  Eigen::VectorXd values(problem.rows().count());
  for (const FitRowIndex j : problem.rows().indices()) {
    values[j.value()] = f(problem.data().conditions[problem.rows()[j]]);
  }
  return values;
}

/// Three entries of an influence from the first on: a shift along x, y and z.
std::vector<int> Three(int first);

/// Blocks by the chi2 that they take away.
using Found = std::vector<std::pair<double, Block>>;

/// The blocks that gain most, the best first, of equal ones the first found.
std::vector<Block> Best(Found found, std::size_t most);

}  // namespace plumbline
