#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "app/measure/diagnosis/diagnosis_steps.h"
#include "app/measure/diagnosis/explained_effects.h"
#include "app/measure/diagnosis/unknown.h"

namespace plumbline::measure {
namespace {

std::vector<int> CarriersOf(const Block& block) {
  std::vector<int> carriers;
  for (const BlockColumn& column : block.columns) {
    if (std::ranges::find(carriers, column.entry) == carriers.end())
      carriers.push_back(column.entry);
  }
  return carriers;
}

/// Every choice of drivers that differs from those of the block in one signal.
std::vector<std::vector<SignalIndex>> OtherDrivers(const Dataset& data, const Block& block) {
  const BlockColumn& any = block.columns.front();
  std::vector<SignalIndex> own = {*any.signal};
  if (any.second_signal) own.push_back(*any.second_signal);
  std::vector<std::vector<SignalIndex>> others;
  for (std::size_t place = 0; place < own.size(); ++place) {
    for (const SignalIndex signal : data.signals.indices()) {
      if (std::ranges::find(own, signal) != own.end()) continue;
      if (own.size() > 1 && data.signals[signal].of_joint) continue;
      others.push_back(own);
      others.back()[place] = signal;
    }
  }
  return others;
}

/// The explanation with an empirical block replaced by the best one of other drivers; nullopt if
/// none scores within kRivalGap of `best`.
std::optional<Explanation> WithOtherDrivers(CandidateSet& candidate_set, const Explanation& best,
                                            BlockIndex block,
                                            const std::vector<SignalIndex>& drivers) {
  const Block replaced = candidate_set.blocks()[block];
  const std::optional<Block> other =
      BestEmpirical(candidate_set.problem(), candidate_set.PartialResidual(best, block), drivers,
                    CarriersOf(replaced));
  if (!other) return std::nullopt;
  const BlockIndex index = candidate_set.Add(*other);
  if (!candidate_set.Observable(index)) return std::nullopt;
  std::vector<BlockIndex> support = best.blocks;
  std::replace(support.begin(), support.end(), block, index);
  return candidate_set.EvaluateBelow(support, best.score + kRivalGap);
}

}  // namespace

void AddDriverRivals(CandidateSet& candidate_set, const Explanation& best, Diagnosis& diagnosis) {
  const Dataset& data = candidate_set.problem().data();
  for (const BlockIndex block : best.blocks) {
    const Block replaced = candidate_set.blocks()[block];
    if (!replaced.empirical()) continue;
    for (const std::vector<SignalIndex>& drivers : OtherDrivers(data, replaced)) {
      const std::optional<Explanation> other =
          WithOtherDrivers(candidate_set, best, block, drivers);
      const bool as_many = other && other->blocks.size() == best.blocks.size();
      if (!as_many || other->score > best.score + kRivalGap) continue;
      std::vector<std::string> columns;
      for (const SignalIndex driver : drivers) columns.push_back(data.signals[driver].column);
      Rival& rival = diagnosis.rivals.emplace_back();
      rival.instead_of = rival.id = replaced.id;
      rival.instead_of_word = fmt::format("{}", fmt::join(replaced.term.drivers, " and "));
      rival.word = fmt::format("{}", fmt::join(columns, " and "));
      rival.signal_left = SignalLeft(candidate_set, best, KeyOf(replaced), other->blocks);
      rival.evidence_gap = other->score - best.score;
      diagnosis.rival_drivers.push_back(columns);
    }
  }
}

}  // namespace plumbline::measure
