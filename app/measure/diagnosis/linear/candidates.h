// Selection of the catalogue effects that a data set can show.
#pragma once

#include "app/measure/diagnosis/linear/blocks.h"

namespace plumbline::measure {

/// An effect that the data cannot show, with the reason.
struct ExcludedCandidate {
  std::string id;
  std::string reason;
  bool real = false;  ///< possible on this arm, but not recorded or declared
};

struct Candidates {
  std::vector<Block> blocks;  ///< effects without searched shapes
  std::vector<const effects::Effect*>
      searched;  ///< effects whose shapes are searched in a residual
  std::vector<ExcludedCandidate> excluded;
};

/// Divides the catalogue into effects that the data can show and effects that they cannot.
Candidates CandidatesFor(const Dataset& data);

/// Blocks with the refitted shapes (cycles, time constants, event times) of these effects, so that
/// a repeated search can select them unchanged.
std::vector<Block> BlocksOf(const Dataset& data, const std::vector<effects::ActiveEffect>& effects);

/// Number of effects among which a search chooses: the catalogue, without the effects of a
/// measuring camera, of ranges or of different cameras if nothing was measured so. Independent of
/// the recorded signals, so that scores of different tables of one cell are comparable.
double EffectsConsidered(const Dataset& data);

/// Names (q2, q3) of the joints that an effect's parameters belong to, ascending.
std::vector<std::string> ScopeOf(const effects::EffectTerm& term);

}  // namespace plumbline::measure
