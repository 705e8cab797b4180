#include "app/diagnosis/line_aliases.h"

#include <algorithm>
#include <cmath>

#include "app/diagnosis/periodic_search.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {
namespace {

constexpr std::size_t kMaxAliases = 2;       // of one line
constexpr std::size_t kMaxExplanations = 4;  // whose lines are replaced

/// nullopt if the explanation already has the other block.
std::optional<Explanation> WithBlock(CandidateSet& candidate_set, const Explanation& explanation,
                                     BlockIndex gone, const Block& instead) {
  std::vector<BlockIndex> support = explanation.blocks;
  const BlockIndex added = candidate_set.Add(instead);
  if (std::find(support.begin(), support.end(), added) != support.end()) return std::nullopt;
  std::replace(support.begin(), support.end(), gone, added);
  std::sort(support.begin(), support.end());
  return candidate_set.Fit(support);
}

std::vector<Explanation> AliasesOf(CandidateSet& candidate_set, const Explanation& explanation) {
  std::vector<Explanation> aliases;
  for (const BlockIndex block : explanation.blocks) {
    const Block of = candidate_set.blocks()[block];  // a copy: Add() moves the blocks
    const std::optional<PeriodicLine> line = LineOf(of);
    if (!line) continue;
    std::size_t added = 0;
    for (const double cycles : AliasedCycles(candidate_set.problem(), *line)) {
      if (added == kMaxAliases) break;
      auto alias = WithBlock(candidate_set, explanation, block, LineAt(of, cycles));
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

}  // namespace plumbline::diagnosis
