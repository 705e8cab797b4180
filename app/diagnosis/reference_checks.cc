#include "app/diagnosis/reference_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/diagnosis/explanation_checks.h"

namespace plumbline::diagnosis {
namespace {

/// A reference as text, and the data without it.
struct WithoutReference {
  std::string name;
  Dataset data;
};

std::vector<WithoutReference> EachReference(const Dataset& data) {
  std::vector<WithoutReference> all;
  const auto name_of = [&](int artefact) {
    return data.cell.artefacts[static_cast<std::size_t>(artefact)].name;
  };
  const auto used = [&](int artefact) { return data.used_artefacts[ArtefactIndex(artefact)]; };
  for (std::size_t k = 0; k < data.cell.distances.size(); ++k) {
    const model::KnownDistance& distance = data.cell.distances[k];
    if (!used(distance.first) || !used(distance.second)) continue;
    WithoutReference& without = all.emplace_back();
    without.name = fmt::format("the distance between {} and {}", name_of(distance.first),
                               name_of(distance.second));
    without.data = data;
    without.data.cell.distances.erase(without.data.cell.distances.begin() +
                                      static_cast<std::ptrdiff_t>(k));
  }
  for (int k = 0; k < static_cast<int>(data.cell.artefacts.size()); ++k) {
    const model::Artefact& artefact = data.cell.artefacts[static_cast<std::size_t>(k)];
    if (!used(k) || !(artefact.place || artefact.direction || artefact.radius_m)) continue;
    WithoutReference& without = all.emplace_back();
    without.name = fmt::format("the declared values of {}", artefact.name);
    without.data = data;
    model::Artefact& unknown = without.data.cell.artefacts[static_cast<std::size_t>(k)];
    unknown.place.reset();
    unknown.direction.reset();
    unknown.radius_m.reset();
  }
  return all;
}

/// The effects of the answer that are still worth their cost in the data.
Result<std::set<EffectKey>> EffectsIn(const Identified& found, const Dataset& data, int threads) {
  Result<Linearisation> linear = LineariseApart(data, found.model, threads);
  if (!linear) return linear.failure();
  const FitProblem fit{data,    found.fit.rows,           found.fit.weights, found.fit.sigma_m,
                       threads, found.fit.row_correlation};
  const LinearProblem problem(fit, std::make_shared<const Linearisation>(std::move(linear).value()),
                              found.model);
  CandidateSet candidate_set(problem);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  std::set<EffectKey> kept;
  for (const BlockIndex block : candidate_set.Evaluate(support).blocks) {
    kept.insert(KeyOf(candidate_set.blocks()[block]));
  }
  return kept;
}

}  // namespace

Result<void> CheckReferences(const Identified& found, int threads, Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return {};
  const std::vector<WithoutReference> references = EachReference(found.fit.data);
  if (references.empty()) return {};
  std::vector<std::set<EffectKey>> kept;
  for (const WithoutReference& without : references) {
    Result<std::set<EffectKey>> effects = EffectsIn(found, without.data, threads);
    if (!effects) return effects.failure();
    kept.push_back(std::move(effects).value());
  }
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTerm& term = finding.effect.term;
    if (!term.drivers.empty()) continue;  // an empirical curve names no cause
    const EffectKey key = KeyOfFinding(finding);
    std::vector<std::string> needed;
    for (std::size_t k = 0; k < references.size(); ++k) {
      if (!kept[k].contains(key)) needed.push_back(references[k].name);
    }
    ExplanationCheck check;
    check.name = "references";
    check.effect = key.id;
    check.figure = static_cast<double>(needed.size());
    check.passed = needed.empty();
    check.sentence =
        needed.empty() ? "the rows show this effect without any single declared distance or place"
                       : fmt::format(
                             "rests on {}: without it the rows do not show this effect, so a wrong "
                             "value there has the same consequence",
                             fmt::join(needed, ", or on "));
    diagnosis.checks.push_back(check);
    if (check.passed) continue;
    diagnosis.doubts.push_back({key.id, ScopeOf(term), check.sentence});
    if (!diagnosis.withheld.empty()) continue;
    diagnosis.withheld = fmt::format(
        "{} {}; confirm that value, or declare another distance or place", key.id, check.sentence);
  }
  return {};
}

}  // namespace plumbline::diagnosis
