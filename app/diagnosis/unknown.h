// What no effect of the catalogue explains: recorded signals that the residual follows.
#pragma once

#include <optional>

#include "app/diagnosis/diagnosis.h"
#include "app/diagnosis/search.h"

namespace plumbline {

/// Adds to the pool the empirical blocks (a carrier times a smooth function of one signal) that
/// fit a residual best; returns their indices, best first.
std::vector<BlockIndex> AddEmpirical(Pool& pool, const Eigen::VectorXd& residual);

/// The curve along one signal, or the surface over two, that lowers a residual's score most;
/// nothing where the signals have too few values.
/// @param drivers   one or two indices into Dataset::signals
/// @param carriers  influences that it moves
std::optional<Block> BestEmpirical(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                   const std::vector<SignalIndex>& drivers,
                                   const std::vector<int>& carriers);

/// The best explanation that may use empirical blocks beside (or instead of) catalogued effects.
/// @param ranked  explanations by the catalogue alone, best first
Explanation WithUnknown(Pool& pool, const std::vector<Explanation>& ranked);

/// How far a residual follows each recorded signal, whatever it moves: share of chi2 and the
/// chance of that by itself, from sign flips of whole clusters, the best of all signals each time.
std::vector<SignalTrace> SignalsOf(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                   int flips);

}  // namespace plumbline
