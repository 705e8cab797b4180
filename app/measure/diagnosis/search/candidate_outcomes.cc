#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/search/rivals.h"

namespace plumbline::measure {
namespace {

/// The fit of one block alone.
CandidateOutcome Alone(const FindingsContext& context, BlockIndex index) {
  const CandidateSet& candidate_set = context.candidate_set;
  CandidateOutcome considered;
  considered.id = candidate_set.blocks()[index].id;
  if (!candidate_set.Observable(index)) {
    considered.reason =
        "not observable in these rows: the free frames or joints that never moved absorb it";
    return considered;
  }
  const Explanation alone = candidate_set.Evaluate({index});
  considered.parameters = static_cast<int>(alone.columns.size());
  considered.chi2_drop = candidate_set.chi2_null() - alone.chi2;
  considered.signal_share = considered.chi2_drop / std::max(1e-12, candidate_set.chi2_null());
  for (const effects::ActiveEffect& effect : EffectsFrom(
           context.problem.data, candidate_set.blocks(), candidate_set.CoefficientsOf(alone))) {
    considered.scope = ScopeOf(effect.term);
  }
  return considered;
}

/// For each effect, the block that explains most alone.
std::map<std::string, CandidateOutcome> BestAlone(const FindingsContext& context) {
  std::map<std::string, CandidateOutcome> by_id;
  for (const BlockIndex index : context.candidate_set.blocks().indices()) {
    if (context.candidate_set.blocks()[index].empirical()) continue;
    const CandidateOutcome considered = Alone(context, index);
    const auto [known, inserted] = by_id.emplace(considered.id, considered);
    if (!inserted && known->second.chi2_drop < considered.chi2_drop) known->second = considered;
  }
  return by_id;
}

/// For each effect, the best score of the explanations that contain it.
std::map<std::string, double> BestScores(const FindingsContext& context) {
  std::map<std::string, double> best;
  for (const Explanation& explanation : context.ranked) {
    for (const std::string& id : EffectIds(context.candidate_set, explanation)) {
      const auto [entry, inserted] = best.emplace(id, explanation.score);
      if (!inserted) entry->second = std::min(entry->second, explanation.score);
    }
  }
  return best;
}

std::string OutcomeText(const CandidateOutcome& considered, const std::vector<Rival>& rivals) {
  if (considered.taken) return "selected";
  if (std::ranges::any_of(rivals, [&](const Rival& rival) { return rival.id == considered.id; })) {
    return "a rival: these rows cannot distinguish it from the answer";
  }
  if (!considered.reason.empty()) return considered.reason;
  if (considered.parameters == 0) return "explains nothing beyond the noise";
  return fmt::format("explains {} alone, but nothing beyond a better explanation",
                     PercentText(considered.signal_share));
}

}  // namespace

std::vector<CandidateOutcome> CandidateOutcomes(const FindingsContext& context,
                                                const Candidates& candidates,
                                                const std::vector<Rival>& rivals) {
  std::vector<CandidateOutcome> outcomes;
  const std::map<std::string, double> best_with = BestScores(context);
  const std::vector<std::string> taken = EffectIds(context.candidate_set, context.best);
  // Elimination by nonlinear refits may leave the answer with a worse score in the linear search.
  const double best = context.ranked.empty()
                          ? context.best.score
                          : std::min(context.best.score, context.ranked.front().score);
  for (auto& [id, considered] : BestAlone(context)) {
    considered.taken = std::ranges::find(taken, id) != taken.end();
    const auto score = best_with.find(id);
    if (score != best_with.end()) {
      considered.evidence_gap = score->second - best;
    } else if (considered.reason.empty() && context.ranked.size() >= kMaxListed) {
      considered.evidence_gap = context.ranked.back().score - best;
      considered.gap_is_lower_bound = true;
    }
    considered.reason = OutcomeText(considered, rivals);
    outcomes.push_back(considered);
  }
  for (const ExcludedCandidate& missing : candidates.excluded) {
    CandidateOutcome& considered = outcomes.emplace_back();
    considered.id = missing.id;
    considered.reason = missing.reason;
  }
  std::ranges::stable_sort(outcomes, [](const CandidateOutcome& a, const CandidateOutcome& b) {
    return a.taken != b.taken ? a.taken : a.chi2_drop > b.chi2_drop;
  });
  return outcomes;
}

}  // namespace plumbline::measure
