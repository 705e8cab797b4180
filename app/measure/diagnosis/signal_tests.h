// Permutation tests of the recorded signals: which ones a residual follows.
#pragma once

#include <vector>

#include "app/measure/diagnosis/diagnosis.h"
#include "app/measure/diagnosis/linear_problem.h"

namespace plumbline::measure {

/// Tests for each recorded signal whether a residual follows it through any carrier: the explained
/// share of chi2, and its p-value by a permutation test that flips the signs of whole clusters and
/// takes the maximum over all signals (family-wise).
/// @param residual  whitened and projected
/// @param flips     number of permutations
std::vector<SignalTrace> TestSignals(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                     int flips);

}  // namespace plumbline::measure
