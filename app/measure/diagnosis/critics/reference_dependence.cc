#include "app/measure/diagnosis/critics/reference_dependence.h"

#include <fmt/format.h>

#include <utility>

#include "app/measure/diagnosis/critics/explanation_checks.h"
#include "app/measure/diagnosis/search/findings.h"

namespace plumbline::measure {
namespace {

/// The effects of the answer that are still worth their cost with this reference unknown.
Result<std::vector<SelectedEffect>> EffectsWithout(const Identified& found,
                                                   const Reference& reference, int threads) {
  Dataset data = found.fit.data;
  data.cell = Without(reference, std::move(data.cell));
  // Declared values of an artefact determine which of its constants are free.
  Result<Linearisation> linear = reference.distance ? Result<Linearisation>(*found.linear)
                                                    : LineariseApart(data, found.model, threads);
  if (!linear) return linear.failure();
  const FitProblem fit = found.fit.WithData(data);
  const LinearProblem problem(fit, std::make_shared<const Linearisation>(std::move(linear).value()),
                              found.model);
  CandidateSet candidate_set(problem);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  return SelectedEffects(candidate_set, candidate_set.Evaluate(support));
}

/// The check of a finding that needs these references.
ExplanationCheck ReferencesCheck(const std::string& effect,
                                 const std::vector<std::string>& needed) {
  ExplanationCheck check;
  check.name = "references";
  check.effect = effect;
  check.figure = static_cast<double>(needed.size());
  check.passed = needed.empty();
  check.sentence =
      needed.empty() ? "the rows show this effect without any single declared distance or place"
                     : fmt::format(
                           "rests on {}: with it unknown, the rows do not show this effect in all "
                           "of its joints, so a wrong value there has the same consequence",
                           fmt::join(needed, ", and on "));
  return check;
}

}  // namespace

Result<std::vector<KeptWithout>> EvaluateWithoutReferences(const Identified& found, int threads) {
  std::vector<KeptWithout> kept;
  if (found.best.blocks.empty()) return kept;
  for (const Reference& reference : ReferencesOf(found.fit.data)) {
    Result<std::vector<SelectedEffect>> effects = EffectsWithout(found, reference, threads);
    if (!effects) return effects.failure();
    kept.push_back({reference, std::move(effects).value()});
  }
  return kept;
}

Opinion OpinionOnReferences(const std::vector<KeptWithout>& kept, const model::CellModel& cell,
                            bool useful, const std::vector<Finding>& findings) {
  Opinion opinion;
  if (kept.empty()) return opinion;
  for (const Finding& finding : findings) {
    const effects::EffectTerm& term = finding.effect.term;
    if (!term.drivers.empty()) continue;  // an empirical curve names no cause
    std::vector<std::string> needed;
    for (const KeptWithout& without : kept) {
      if (!SelectedWhole(without.effects, finding))
        needed.push_back(NameOf(without.reference, cell));
    }
    const std::string id = KeyOfFinding(finding).id;
    const ExplanationCheck check = ReferencesCheck(id, needed);
    opinion.checks.push_back(check);
    if (check.passed) continue;
    opinion.doubts.push_back({id, ScopeOf(term), check.sentence});
    if (!opinion.withheld.empty() || useful) continue;
    opinion.withheld = fmt::format(
        "{} {}; confirm that value, or declare another distance or place", id, check.sentence);
  }
  return opinion;
}

}  // namespace plumbline::measure
