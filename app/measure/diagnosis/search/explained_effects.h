// Properties of the effects in an explanation: keys, blocks, and the share that a rival cannot
// reproduce.
#pragma once

#include <string>
#include <vector>

#include "app/measure/diagnosis/linear/candidate_set.h"

namespace plumbline::measure {

/// True if an explanation contains an empirical term.
bool HasEmpirical(const CandidateSet& candidate_set, const Explanation& explanation);

/// The distinct effects of an explanation, ascending.
std::vector<EffectKey> EffectKeys(const CandidateSet& candidate_set,
                                  const Explanation& explanation);
/// The distinct ids of the effects of an explanation, ascending.
std::vector<std::string> EffectIds(const CandidateSet& candidate_set,
                                   const Explanation& explanation);

/// The blocks of an explanation that belong to an effect.
std::vector<BlockIndex> BlocksOfEffect(const CandidateSet& candidate_set,
                                       const Explanation& explanation, const EffectKey& key);

/// True if the rows show the shape of every effect of an explanation (ShapeSearch::Visible), and an
/// effect with a time constant fits better than its constant limit by the evidence that rules out a
/// rival.
bool ShapesAreVisible(const CandidateSet& candidate_set, const Explanation& explanation);

/// Share (0..1) of an effect's displacement in an explanation that the blocks of a rival cannot
/// reproduce.
double SignalLeft(const CandidateSet& candidate_set, const Explanation& explanation,
                  const EffectKey& key, const std::vector<BlockIndex>& rival);

/// ln of the number of ways to choose the kept units (joints) of a block from the observable ones.
double LogChoices(const CandidateSet& candidate_set, const Explanation& explanation,
                  BlockIndex block);

}  // namespace plumbline::measure
