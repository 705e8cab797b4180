#include "app/measure/diagnosis/event_outliers.h"

#include <algorithm>

#include "app/measure/diagnosis/robust.h"

namespace plumbline::measure {
namespace {

using RefitWith = std::function<Result<Refit>(const FitProblem&, const Explanation&)>;

/// An explanation refitted with the row weights that follow from its own residuals.
struct RobustFit {
  Refit refit;
  double score = 0;  ///< bounded loss plus cost
};

std::optional<PerRow<RowResidual>> ResidualsAt(const FitProblem& fit, const Model& model) {
  const Result<Linearisation> linear = Linearise(fit.data, model, false, fit.threads);
  if (!linear) return std::nullopt;
  return ResidualsOf(*linear);
}

std::optional<RobustFit> FitRobustly(FitProblem fit, const Explanation& explanation, double sigma_m,
                                     const RefitWith& refit) {
  constexpr int kRounds = 3;  // of weights and fit
  RobustFit robust;
  for (int round = 0; round < kRounds; ++round) {
    Result<Refit> refitted = refit(fit, explanation);
    if (!refitted) return std::nullopt;
    robust.refit = std::move(refitted).value();
    const auto residuals = ResidualsAt(fit, robust.refit.model);
    if (!residuals) return std::nullopt;
    fit.weights = HampelWeights(fit.data, *residuals, sigma_m);
    robust.score = HampelLoss(fit.data, *residuals, sigma_m) + explanation.score - explanation.chi2;
  }
  return robust;
}

Explanation Without(const CandidateSet& candidate_set, const Explanation& explanation,
                    BlockIndex gone) {
  std::vector<ColumnIndex> columns;
  for (const ColumnIndex column : explanation.columns) {
    if (candidate_set.BlockOfColumn(column) != gone) columns.push_back(column);
  }
  return candidate_set.FitColumns(columns);
}

/// The explanation without the first event that scores no better than rejecting its rows.
std::optional<std::pair<Explanation, RobustFit>> BetterWithoutOne(const FitProblem& fit,
                                                                  const CandidateSet& candidate_set,
                                                                  const Explanation& with,
                                                                  double sigma_m,
                                                                  const RefitWith& refit) {
  const std::optional<RobustFit> of_with = FitRobustly(fit, with, sigma_m, refit);
  if (!of_with) return std::nullopt;
  for (const BlockIndex block : with.blocks) {
    if (!ActsFromEventTime(candidate_set.blocks()[block].term)) continue;
    Explanation without = Without(candidate_set, with, block);
    std::optional<RobustFit> of_without = FitRobustly(fit, without, sigma_m, refit);
    if (!of_without || of_without->score > of_with->score) continue;
    return std::pair(std::move(without), std::move(*of_without));
  }
  return std::nullopt;
}

}  // namespace

WithoutOutlierEvents DropOutlierEvents(const FitProblem& fit, const CandidateSet& candidate_set,
                                       RefittedExplanation found, const RefitWith& refit) {
  WithoutOutlierEvents result{std::move(found), false};
  const auto& blocks = result.kept.explanation.blocks;
  const bool any_event = std::any_of(blocks.begin(), blocks.end(), [&](BlockIndex block) {
    return ActsFromEventTime(candidate_set.blocks()[block].term);
  });
  if (!any_event || blocks.size() > kMaxRefittedBlocks) return result;
  const auto residuals = ResidualsAt(fit, result.kept.refit.model);
  if (!residuals) return result;
  const double sigma_m = std::max(fit.data.sigma_m, RobustSigma(fit.data, *residuals));
  const PerRow<double> weights = HampelWeights(fit.data, *residuals, sigma_m);
  const bool rejects = std::any_of(weights.begin(), weights.end(),
                                   [](double weight) { return weight < kOutlierWeight; });
  if (!rejects) return result;
  while (auto better =
             BetterWithoutOne(fit, candidate_set, result.kept.explanation, sigma_m, refit)) {
    result.kept = {std::move(better->first), std::move(better->second.refit)};
    result.dropped = true;
  }
  return result;
}

}  // namespace plumbline::measure
