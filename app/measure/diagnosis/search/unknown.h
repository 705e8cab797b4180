// Empirical terms for causes outside the catalogue: recorded signals that the residual follows.
#pragma once

#include <optional>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/search/search.h"

namespace plumbline::measure {

/// Adds to the candidate set the empirical blocks that fit a residual best: a carrier times a
/// smooth function of one signal, or of two signals and their product.
/// @param residual  whitened and projected
/// @return          their indices, best first
std::vector<BlockIndex> AddEmpirical(CandidateSet& candidate_set, const Eigen::VectorXd& residual);

/// The curve along one signal, or the surface over two, that lowers the score of a residual most;
/// nullopt if the signals have too few distinct values.
/// @param residual  whitened and projected
/// @param drivers   one or two signals
/// @param carriers  entries of the influence that the block acts on
std::optional<Block> BestEmpirical(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                   const std::vector<SignalIndex>& drivers,
                                   const std::vector<int>& carriers);

/// The best explanation with or without one empirical block, in addition to or instead of catalogue
/// effects.
/// @param candidate_set    extended by empirical blocks
/// @param ranked  explanations from the catalogue alone, best first; not empty
Explanation WithUnknown(CandidateSet& candidate_set, const std::vector<Explanation>& ranked);

}  // namespace plumbline::measure
