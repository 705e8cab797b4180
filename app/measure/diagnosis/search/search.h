// Search for the combination of effects with the best evidence: all single effects and pairs, then
// a beam search from the best.
#pragma once

#include <functional>
#include <vector>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/candidate_set.h"

namespace plumbline::measure {

/// Maximum number of blocks in an explanation; more would be a fit without explanatory value.
inline constexpr std::size_t kMaxBlocks = 30;

/// Maximum number of explanations that a search returns.
inline constexpr std::size_t kMaxListed = 60;

/// The best distinct explanations, best first; an explanation may be empty ("no effect"). Shapes
/// (cycles, time constants, event times) are searched in the residuals of promising explanations.
/// @param candidate_set         extended by the candidate blocks and the proposed shapes
/// @param most         maximum number of blocks in an explanation
/// @param interrupted  polled; if it returns true, the search ends early with what it has
std::vector<Explanation> Search(CandidateSet& candidate_set, const Candidates& candidates,
                                std::size_t most, const std::function<bool()>& interrupted);

/// Adds the best shapes of the searched effects for a residual to the candidate set; returns their
/// indices.
std::vector<BlockIndex> AddShapes(CandidateSet& candidate_set,
                                  const std::vector<const effects::Effect*>& searched,
                                  const Eigen::VectorXd& residual);

}  // namespace plumbline::measure
