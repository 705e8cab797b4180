#include "app/measure/diagnosis/linear/shape_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/plausibility.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxTries = 3;  // failed refits in one round after which elimination ends
/// A unit is tried if its Wald statistic is below this multiple of its cost. The statistic is a
/// quadratic approximation; the increase of chi2 after the refit may be smaller.
constexpr double kMaxWaldRatio = 2;

using UnitParameters = std::map<BlockUnit, std::vector<int>>;

/// Indices into the covariance of the refitted sizes of each unit.
UnitParameters SizesOfUnits(const CandidateSet& candidate_set,
                            const RefittedExplanation& refitted) {
  const EffectsOfUnits from =
      EffectsAndUnits(candidate_set.problem().data(), candidate_set.blocks(),
                      candidate_set.CoefficientsOf(refitted.explanation));
  UnitParameters sizes;
  for (std::size_t j = 0; j < refitted.refit.parameters.size(); ++j) {
    const auto effect = static_cast<std::size_t>(refitted.refit.parameters[j].first);
    const auto value = static_cast<std::size_t>(refitted.refit.parameters[j].second);
    const effects::EffectTerm& term = refitted.refit.model.effects[effect].term;
    const auto spec = static_cast<std::size_t>(term.parameters[value].spec);
    if (term.effect->traits().parameters[spec].role != effects::ParameterRole::kSize) continue;
    sizes[from.units[effect][value]].push_back(static_cast<int>(j));
  }
  return sizes;
}

/// Wald statistic v^T C^-1 v of some refitted sizes v with covariance C: the increase of chi2, to
/// second order, if they are set to 0. 0 if one of them is not identifiable.
double Wald(const Refit& refit, const std::vector<int>& places) {
  const auto n = static_cast<Eigen::Index>(places.size());
  Eigen::VectorXd values(n), scale(n);
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int at = places[i];
    if (!refit.identifiable[at] || !(refit.covariance(at, at) > 0)) return 0;
    scale[i] = std::sqrt(refit.covariance(at, at));
    const auto [effect, value] = refit.parameters[at];
    values[i] = refit.model.effects[effect].values[value] / scale[i];
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      correlation(i, j) = refit.covariance(places[i], places[j]) / (scale[i] * scale[j]);
    }
  }
  return values.dot(correlation.ldlt().solve(values));
}

/// An explanation with one unit less.
struct Smaller {
  Explanation explanation;
  double saved = 0;   ///< reduction of the cost
  double excess = 0;  ///< Wald statistic minus the saved cost
};

std::vector<ColumnIndex> ColumnsWithout(const CandidateSet& candidate_set,
                                        const Explanation& explanation, const BlockUnit& gone) {
  std::vector<ColumnIndex> columns;
  for (const ColumnIndex column : explanation.columns) {
    const bool of_it = candidate_set.BlockOfColumn(column) == gone.block &&
                       candidate_set.UnitOfColumn(column) == gone.number;
    if (!of_it) columns.push_back(column);
  }
  return columns;
}

/// False if a refitted size is impossible: beyond ten times the largest plausible one, or with a
/// sign that physics excludes; as in the linear search (CandidateSet::Evaluate).
bool WithinBounds(const Dataset& data, const Model& model) {
  return std::ranges::all_of(model.effects, [&](const effects::ActiveEffect& effect) {
    return ImplausibilityOf(data, effect).times <= kDiscardRatio;
  });
}

/// Explanations with one unit less that are worth a refit, the smallest loss first.
std::vector<Smaller> SmallerExplanations(const CandidateSet& candidate_set,
                                         const RefittedExplanation& refitted) {
  std::vector<Smaller> smaller;
  for (const auto& [unit, places] : SizesOfUnits(candidate_set, refitted)) {
    Smaller& one = smaller.emplace_back();
    one.explanation =
        candidate_set.FitColumns(ColumnsWithout(candidate_set, refitted.explanation, unit));
    one.saved = refitted.explanation.prior_and_cost() - one.explanation.prior_and_cost();
    const double wald = Wald(refitted.refit, places);
    one.excess = wald - one.saved;
    if (wald > kMaxWaldRatio * one.saved) smaller.pop_back();
  }
  std::ranges::stable_sort(smaller,
                           [](const Smaller& a, const Smaller& b) { return a.excess < b.excess; });
  if (smaller.size() > kMaxTries) smaller.resize(kMaxTries);
  return smaller;
}

std::optional<RefittedExplanation> BestSmaller(const CandidateSet& candidate_set,
                                               const RefittedExplanation& whole,
                                               const RefitExplanation& refit) {
  const Dataset& data = candidate_set.problem().data();
  const bool within = WithinBounds(data, whole.refit.model);
  for (Smaller& one : SmallerExplanations(candidate_set, whole)) {
    Result<Refit> refitted = refit(one.explanation);
    if (!refitted || refitted->chi2 - whole.refit.chi2 > one.saved) continue;
    // Another unit may absorb what this one explained, but only with an impossible size.
    if (within && !WithinBounds(data, refitted->model)) continue;
    return RefittedExplanation{std::move(one.explanation), std::move(refitted).value()};
  }
  return std::nullopt;
}

}  // namespace

RefittedExplanation EliminateUnsupportedUnits(const CandidateSet& candidate_set,
                                              RefittedExplanation refitted,
                                              const RefitExplanation& refit) {
  if (refitted.explanation.blocks.size() > kMaxRefittedBlocks) return refitted;
  while (auto smaller = BestSmaller(candidate_set, refitted, refit)) refitted = std::move(*smaller);
  return refitted;
}

namespace {

constexpr int kMaxShapeRows = 400;  // enough to determine shapes during a search

/// Every n-th row, at most kMaxShapeRows in total.
FitRows EveryNth(const FitRows& rows) {
  const int step = (rows.count() + kMaxShapeRows - 1) / kMaxShapeRows;
  FitRows subset;
  for (int k = 0; k < rows.count(); k += step) subset.push_back(rows[FitRowIndex(k)]);
  return subset;
}

/// Blocks with the refitted shapes of an effect; empty if it has no searched shapes.
std::vector<Block> RefittedBlocks(const Dataset& data, const effects::ActiveEffect& effect) {
  const ShapeSearch* const search = ShapeSearchOf(*effect.term.effect);
  return search != nullptr ? search->Refitted(data, effect) : std::vector<Block>{};
}

}  // namespace

Explanation WithRefittedShapes(CandidateSet& candidate_set, const Explanation& chosen) {
  if (chosen.blocks.size() > kMaxRefittedBlocks) return chosen;
  const FitProblem& all_rows = candidate_set.problem().fit();
  const bool few = all_rows.rows.count() <= kMaxShapeRows;
  const bool has_continuous_shape =
      std::ranges::any_of(chosen.blocks, [&candidate_set](BlockIndex block) {
        return HasContinuousShape(candidate_set.blocks()[block]);
      });
  if (!few && !has_continuous_shape) return chosen;  // nothing below would change it
  const FitProblem fit = few ? all_rows : all_rows.WithRows(EveryNth(all_rows.rows));
  RefitOptions options;
  options.first_order = &candidate_set.problem();
  const auto refit_to = [&](const Explanation& explanation) {
    Model start = candidate_set.problem().aligned();
    start.effects =
        EffectsFrom(fit.data, candidate_set.blocks(), candidate_set.CoefficientsOf(explanation));
    return RefitModel(fit, start, options);
  };
  Result<Refit> refit = refit_to(chosen);
  if (!refit) return chosen;
  RefittedExplanation kept{chosen, std::move(refit).value()};
  // A subset of the rows determines the shapes, but underestimates the evidence for a unit.
  if (few) kept = EliminateUnsupportedUnits(candidate_set, std::move(kept), refit_to);
  std::vector<const effects::Effect*> reshaped;
  std::vector<BlockIndex> blocks;
  for (const effects::ActiveEffect& effect : kept.refit.model.effects) {
    for (const Block& block : RefittedBlocks(fit.data, effect)) {
      blocks.push_back(candidate_set.Add(block));
      reshaped.push_back(effect.term.effect);
    }
  }
  std::vector<ColumnIndex> columns = candidate_set.ColumnsOf(blocks);
  for (const ColumnIndex column : kept.explanation.columns) {
    const effects::Effect* const effect =
        candidate_set.blocks()[candidate_set.BlockOfColumn(column)].term.effect;
    if (std::ranges::find(reshaped, effect) == reshaped.end()) {
      columns.push_back(column);
    }
  }
  std::ranges::sort(columns);
  std::vector<BlockIndex> support;
  for (const ColumnIndex column : columns) support.push_back(candidate_set.BlockOfColumn(column));
  std::vector<const Block*> shapes;
  for (const BlockIndex block : std::set<BlockIndex>(support.begin(), support.end())) {
    shapes.push_back(&candidate_set.blocks()[block]);
  }
  const auto better = [](const Explanation& a, const Explanation& b) { return a.score < b.score; };
  const Explanation& unshaped = std::min(chosen, kept.explanation, better);
  if (ShapesConflict(candidate_set.problem(), shapes)) return unshaped;
  return std::min(unshaped, candidate_set.Evaluate(support), better);
}

effects::ActiveEffect ShapeSearch::EffectFrom(const Block& block, const ColumnSizes& values) const {
  return EffectFromSizes(block, values);
}

bool ShapesConflict(const LinearProblem& problem, std::span<const Block* const> support) {
  for (auto block = support.begin(); block != support.end(); ++block) {
    const effects::Effect* const effect = (*block)->term.effect;
    const bool already_checked =
        std::any_of(support.begin(), block,
                    [effect](const Block* earlier) { return earlier->term.effect == effect; });
    if (already_checked) continue;
    const ShapeSearch* const search = ShapeSearchOf(*effect);
    if (search != nullptr && search->Excludes(problem, support)) return true;
  }
  return false;
}

}  // namespace plumbline::measure
