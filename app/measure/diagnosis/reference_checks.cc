#include "app/measure/diagnosis/reference_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/measure/diagnosis/explanation_checks.h"
#include "app/measure/diagnosis/references.h"

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

}  // namespace

Result<void> CheckReferences(const Identified& found, int threads, bool useful,
                             Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return {};
  const std::vector<Reference> references = ReferencesOf(found.fit.data);
  if (references.empty()) return {};
  std::vector<std::vector<SelectedEffect>> kept;
  for (const Reference& reference : references) {
    Result<std::vector<SelectedEffect>> effects = EffectsWithout(found, reference, threads);
    if (!effects) return effects.failure();
    kept.push_back(std::move(effects).value());
  }
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTerm& term = finding.effect.term;
    if (!term.drivers.empty()) continue;  // an empirical curve names no cause
    const EffectKey key = KeyOfFinding(finding);
    std::vector<std::string> needed;
    for (std::size_t k = 0; k < references.size(); ++k) {
      if (!SelectedWhole(kept[k], finding))
        needed.push_back(NameOf(references[k], found.fit.data.cell));
    }
    ExplanationCheck check;
    check.name = "references";
    check.effect = key.id;
    check.figure = static_cast<double>(needed.size());
    check.passed = needed.empty();
    check.sentence =
        needed.empty()
            ? "the rows show this effect without any single declared distance or place"
            : fmt::format(
                  "rests on {}: with it unknown, the rows do not show this effect in all "
                  "of its joints, so a wrong value there has the same consequence",
                  fmt::join(needed, ", and on "));
    diagnosis.checks.push_back(check);
    if (check.passed) continue;
    diagnosis.doubts.push_back({key.id, ScopeOf(term), check.sentence});
    if (!diagnosis.withheld.empty() || useful) continue;
    diagnosis.withheld = fmt::format(
        "{} {}; confirm that value, or declare another distance or place", key.id, check.sentence);
  }
  return {};
}

}  // namespace plumbline::measure
