// Explanation of the residual: a subset of the candidate blocks with its fitted values and score.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "app/measure/diagnosis/blocks.h"
#include "app/measure/diagnosis/indices.h"

namespace plumbline::measure {

/// Fit of a subset (support) of the blocks, without the units that cost more than they explain.
struct Explanation {
  std::vector<BlockIndex> blocks;    ///< ascending
  std::vector<ColumnIndex> columns;  ///< kept columns of the candidate set
  Eigen::VectorXd values;            ///< fitted values of those columns, SI
  double chi2 = 0;                   ///< of the residual
  double prior = 0;                  ///< sum of (value / plausible)^2
  double score = 0;                  ///< chi2 + (value / plausible)^2 of each column + cost;
                                     ///< -2 ln(evidence) up to a constant

  double prior_and_cost() const { return score - chi2; }
};

/// Identifies an effect in an explanation: its id and its variant, if it has one ("base", "move").
/// Two variants of one id are different effects.
struct EffectKey {
  std::string id, word;
  auto operator<=>(const EffectKey&) const = default;  // NOLINT(modernize-use-nullptr)
};

inline EffectKey KeyOf(const Block& block) {
  return {block.id, std::string(block.term.word)};
}

}  // namespace plumbline::measure
