#include "app/diagnosis/detectable.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "app/diagnosis/shape_search.h"
#include "app/diagnosis/words.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline {
namespace {

/// Joint, spec and second joint of a size.
using SizeName = std::tuple<int, int, int>;

/// Of one effect, over all its blocks.
struct Seen {
  double least_m = 0;             ///< 0: nothing of it is visible
  std::set<SizeName> hidden;      ///< by a block
  std::set<SizeName> not_hidden;  ///< by another block
};

void Add(const Pool& pool, BlockIndex block, double cost, Seen& seen) {
  const Block& of = pool.blocks()[block];
  const Indexed<BlockColumnIndex, double> least_m = pool.MinimumDetectable(block, cost);
  for (const BlockColumnIndex k : least_m.indices()) {
    const TermParameter& parameter =
        of.term.parameters[static_cast<std::size_t>(of.columns[k].parameter)];
    const SizeName name(parameter.joint, parameter.spec, parameter.of);
    (least_m[k] > 0 ? seen.not_hidden : seen.hidden).insert(name);
    seen.least_m = std::max(seen.least_m, least_m[k]);
  }
}

/// "joint offset (q1, q6)"; the name alone where nothing of it is visible.
std::string HiddenText(const std::string& id, const Seen& seen) {
  const EffectTraits& traits = FindEffect(id)->traits();
  std::vector<std::string> names;
  for (const auto& [joint, spec, of] : seen.hidden) {
    if (seen.not_hidden.contains({joint, spec, of})) continue;
    names.push_back(NameFromParameter(traits, {spec, joint, 1, of}));
  }
  if (names.empty()) return "";
  if (seen.least_m == 0) return EffectName(id);
  return fmt::format("{} ({})", EffectName(id), fmt::join(names, ", "));
}

}  // namespace

void AddDetectable(const Pool& pool, const Candidates& candidates, Diagnosis& diagnosis) {
  std::map<std::string, double> costs;
  for (const BlockIndex b : pool.blocks().indices()) {
    double& cost = costs[pool.blocks()[b].id];
    cost = std::max(cost, pool.BlockCost(b));
  }
  std::map<std::string, Seen> effects;
  for (const BlockIndex b : pool.blocks().indices()) {
    const Block& block = pool.blocks()[b];
    if (block.empirical()) continue;
    Add(pool, b, costs[block.id], effects[block.id]);
  }
  // The pool has only the shapes that followed the residual best.
  for (const Effect* effect : candidates.searched) {
    const std::string id(effect->traits().id);
    if (!costs.contains(id)) continue;
    Pool every(pool.problem());
    for (const Block& block : ShapeSearchOf(*effect)->Everywhere(pool.problem().data())) {
      Add(every, every.Add(block), costs[id], effects[id]);
    }
  }
  std::vector<std::string> hidden;
  for (const auto& [id, seen] : effects) {
    if (seen.least_m > 0) diagnosis.minimum_detectable_m[id] = seen.least_m;
    if (std::string text = HiddenText(id, seen); !text.empty()) hidden.push_back(std::move(text));
  }
  if (hidden.empty()) return;
  diagnosis.notes.push_back(fmt::format(
      "not visible in these rows at any size that a sound machine shows (frames, short levers or "
      "joints that hardly move hide it): {}",
      fmt::join(hidden, ", ")));
}

}  // namespace plumbline
