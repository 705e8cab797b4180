// The search for whole effects, scored by evidence: all single ones and pairs, what grows beyond
// from the best.
#pragma once

#include <functional>
#include <vector>

#include "app/diagnosis/pool.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline {

/// Most blocks of an explanation; what needs more is not explained but fitted.
inline constexpr std::size_t kMostBlocks = 30;

/// Explanations that a search lists at most.
inline constexpr std::size_t kMostListed = 60;

/// The best explanations of distinct effects, best first; the first may be empty ("nothing").
/// Shapes (cycles, time constants, moments) are searched in the residual of what is promising.
/// @param most  blocks in an explanation
std::vector<Explanation> Search(Pool& pool, const Candidates& candidates, std::size_t most,
                                const std::function<bool()>& interrupted);

/// Adds to the pool the best shapes of the searched effects for a residual; returns their indices.
std::vector<BlockIndex> AddShapes(Pool& pool, const std::vector<const Effect*>& searched,
                                  const Eigen::VectorXd& residual);

}  // namespace plumbline
