#include "app/measure/diagnosis/detectable.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/not_observable.h"
#include "app/measure/diagnosis/shape_search.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

/// Joint, parameter spec and second joint of a size.
using SizeName = std::tuple<int, int, int>;

/// Detection limit of one effect over all its blocks.
struct Detectability {
  double limit_m = 0;               ///< largest over its detectable sizes; 0: none is detectable
  std::set<SizeName> undetectable;  ///< in at least one block
  std::set<SizeName> detectable;    ///< in at least one block
};

void Add(const CandidateSet& candidate_set, BlockIndex block, double cost, Detectability& found) {
  const Block& of = candidate_set.blocks()[block];
  const Indexed<BlockColumnIndex, double> limits_m = candidate_set.MinimumDetectable(block, cost);
  for (const BlockColumnIndex k : limits_m.indices()) {
    const effects::TermParameter& parameter =
        of.term.parameters[static_cast<std::size_t>(of.columns[k].parameter)];
    const SizeName name(parameter.joint, parameter.spec, parameter.of);
    (limits_m[k] > 0 ? found.detectable : found.undetectable).insert(name);
    found.limit_m = std::max(found.limit_m, limits_m[k]);
  }
}

/// The undetectable sizes of an effect; nullopt if it has none.
std::optional<NotObservable> UndetectableSizes(const std::string& id, const Detectability& found) {
  const effects::EffectTraits& traits = effects::FindEffect(id)->traits();
  NotObservable sizes{id, {}, {}, {}};
  std::set<int> joints;
  for (const auto& [joint, spec, of] : found.undetectable) {
    if (found.detectable.contains({joint, spec, of})) continue;
    sizes.parameters.push_back(effects::NameFromParameter(traits, {spec, joint, 1, of}));
    if (joint >= 0) joints.insert(joint);
  }
  if (sizes.parameters.empty()) return std::nullopt;
  for (const int joint : joints) sizes.scope.push_back(fmt::format("q{}", joint + 1));
  sizes.reason =
      "no size that is plausible for a healthy machine would be detected in these rows: free "
      "frames or places absorb it, its lever arms are short, or its joints hardly move";
  return sizes;
}

/// "joint offset (q1, q6)"; the name alone if no size of the effect is detectable.
std::string UndetectableText(const NotObservable& sizes, const Detectability& found) {
  if (found.limit_m == 0) return EffectName(sizes.id);
  return fmt::format("{} ({})", EffectName(sizes.id), fmt::join(sizes.parameters, ", "));
}

}  // namespace

void AddDetectable(const CandidateSet& candidate_set, const Candidates& candidates,
                   Diagnosis& diagnosis) {
  std::map<std::string, double> costs;
  for (const BlockIndex b : candidate_set.blocks().indices()) {
    double& cost = costs[candidate_set.blocks()[b].id];
    cost = std::max(cost, candidate_set.BlockCost(b));
  }
  std::map<std::string, Detectability> effects;
  for (const BlockIndex b : candidate_set.blocks().indices()) {
    const Block& block = candidate_set.blocks()[b];
    if (block.empirical()) continue;
    Add(candidate_set, b, costs[block.id], effects[block.id]);
  }
  // The candidate set contains only the shapes that followed the residual best.
  for (const effects::Effect* effect : candidates.searched) {
    const std::string id(effect->traits().id);
    if (!costs.contains(id)) continue;
    CandidateSet all_shapes(candidate_set.problem());
    for (const Block& block :
         ShapeSearchOf(*effect)->AllPlacements(candidate_set.problem().data())) {
      Add(all_shapes, all_shapes.Add(block), costs[id], effects[id]);
    }
  }
  AddFreeOfArtefacts(candidate_set.problem(), diagnosis);
  std::vector<std::string> undetectable;
  for (const auto& [id, found] : effects) {
    if (found.limit_m > 0) diagnosis.minimum_detectable_m[id] = found.limit_m;
    const std::optional<NotObservable> sizes = UndetectableSizes(id, found);
    if (!sizes) continue;
    undetectable.push_back(UndetectableText(*sizes, found));
    diagnosis.not_observable.push_back(*sizes);
  }
  if (undetectable.empty()) return;
  diagnosis.notes.push_back(fmt::format(
      "not detectable in these rows at any size plausible for a healthy machine (absorbed by free "
      "frames, short lever arms or joints that hardly move): {}",
      fmt::join(undetectable, ", ")));
}

}  // namespace plumbline::measure
