// Candidate explanations: what of the catalogue these data can show, and what they cannot.
#pragma once

#include "app/diagnosis/blocks.h"

namespace plumbline {

/// A candidate that these data cannot show, and why.
struct NotOffered {
  std::string id;
  std::string reason;
};

struct Candidates {
  std::vector<Block> blocks;            ///< effects without searched shapes
  std::vector<const Effect*> searched;  ///< effects whose shapes are searched in the residual
  std::vector<NotOffered> not_offered;
};

/// What the data can show of the catalogue.
Candidates CandidatesFor(const Dataset& data);

/// Blocks with the shapes (cycles, time constants, moments) of effects that were refitted, so that
/// a search finds them again as they are.
std::vector<Block> BlocksOf(const Dataset& data, const std::vector<ActiveEffect>& effects);

/// Whole effects among which an explanation chooses: the catalogue, the effects of a measuring
/// camera and of ranges only where these measure. Whether other signals were recorded does not
/// matter, so that scores of tables of one cell can be compared.
double EffectsConsidered(const Dataset& data);

/// Joint names (q2, q3) of an effect's parameters.
std::vector<std::string> ScopeOf(const EffectTerm& term);

}  // namespace plumbline
