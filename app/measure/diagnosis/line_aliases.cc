#include "app/measure/diagnosis/line_aliases.h"

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/periodic_search.h"
#include "app/measure/diagnosis/shape_search.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxAliases = 2;       // of one line
constexpr std::size_t kMaxExplanations = 4;  // whose lines are replaced

/// The explanation with one block replaced; nullopt if it already has the replacement, or if that
/// is not resolved from another of its lines.
std::optional<Explanation> WithReplacement(CandidateSet& candidate_set,
                                           const Explanation& explanation, BlockIndex removed,
                                           const Block& replacement) {
  std::vector<BlockIndex> support = explanation.blocks;
  const BlockIndex added = candidate_set.Add(replacement);
  if (std::find(support.begin(), support.end(), added) != support.end()) return std::nullopt;
  std::replace(support.begin(), support.end(), removed, added);
  std::sort(support.begin(), support.end());
  std::vector<const Block*> blocks;
  for (const BlockIndex block : support) blocks.push_back(&candidate_set.blocks()[block]);
  if (ShapesConflict(candidate_set.problem(), blocks)) return std::nullopt;
  return candidate_set.Fit(support);
}

std::vector<Explanation> AliasesOf(CandidateSet& candidate_set, const Explanation& explanation) {
  std::vector<Explanation> aliases;
  for (const BlockIndex block : explanation.blocks) {
    const Block line_block = candidate_set.blocks()[block];  // a copy: Add() moves the blocks
    const std::optional<PeriodicLine> line = LineOf(line_block);
    if (!line) continue;
    std::size_t added = 0;
    for (const double cycles : AliasedCycles(candidate_set.problem(), *line)) {
      if (added == kMaxAliases) break;
      auto alias = WithReplacement(candidate_set, explanation, block, LineAt(line_block, cycles));
      if (!alias) continue;
      aliases.push_back(*std::move(alias));
      ++added;
    }
  }
  return aliases;
}

}  // namespace

void AddLineAliases(CandidateSet& candidate_set, const Explanation& best,
                    std::vector<Explanation>& ranked) {
  std::vector<Explanation> aliases = AliasesOf(candidate_set, best);
  for (std::size_t k = 0; k < std::min(kMaxExplanations, ranked.size()); ++k) {
    const Explanation other = ranked[k];
    if (other.columns == best.columns || other.score > best.score + kRefitScoreRange) continue;
    for (Explanation& alias : AliasesOf(candidate_set, other)) aliases.push_back(std::move(alias));
  }
  ranked.insert(ranked.end(), aliases.begin(), aliases.end());
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Explanation& a, const Explanation& b) { return a.score < b.score; });
}

}  // namespace plumbline::measure
