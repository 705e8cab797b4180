#include "app/measure/diagnosis/search/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/candidate_set.h"
#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/search/unknown.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"

namespace plumbline::measure {
namespace {

// Test of each event in an explanation against the alternative that its rows are outliers.

/// An explanation without the events that only outliers support.
struct WithoutOutlierEvents {
  RefittedExplanation kept;
  bool dropped = false;  ///< an event was dropped; more rows than kMaxOutliers may be outliers
};

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

/// Compares each event with the alternative that its rows are outliers. The score is Hampel's
/// bounded loss over all rows, in which every rejected row costs the same, plus the cost of the
/// effects. Both alternatives are refitted with their own weights at the robust noise estimate,
/// which runs of outliers hardly raise. The usual limit of one rejected row in ten does not apply:
/// it would leave outliers in the fit, and a step could explain a part of each run. A true step
/// explains its rows completely and saves about 41 for each position otherwise rejected.
/// @param fit    rows and weights with which the explanation was found
/// @param refit  fits an explanation to a problem with other weights
WithoutOutlierEvents DropOutlierEvents(const FitProblem& fit, const CandidateSet& candidate_set,
                                       RefittedExplanation found, const RefitWith& refit) {
  WithoutOutlierEvents result{std::move(found), false};
  const auto& blocks = result.kept.explanation.blocks;
  const bool any_event = std::ranges::any_of(blocks, [&](BlockIndex block) {
    return ActsFromEventTime(candidate_set.blocks()[block].term);
  });
  if (!any_event || blocks.size() > kMaxRefittedBlocks) return result;
  const auto residuals = ResidualsAt(fit, result.kept.refit.model);
  if (!residuals) return result;
  const double sigma_m = std::max(fit.data.sigma_m, RobustSigma(fit.data, *residuals));
  const PerRow<double> weights = HampelWeights(fit.data, *residuals, sigma_m);
  const bool rejects =
      std::ranges::any_of(weights, [](double weight) { return weight < kOutlierWeight; });
  if (!rejects) return result;
  while (auto better =
             BetterWithoutOne(fit, candidate_set, result.kept.explanation, sigma_m, refit)) {
    result.kept = {std::move(better->first), std::move(better->second.refit)};
    result.dropped = true;
  }
  return result;
}

// Aliases of spectral lines along a joint whose readings are equally spaced.

constexpr std::size_t kMaxAliases = 2;       // of one line
constexpr std::size_t kMaxExplanations = 4;  // whose lines are replaced

/// The explanation with one block replaced; nullopt if it already has the replacement, or if that
/// is not resolved from another of its lines.
std::optional<Explanation> WithReplacement(CandidateSet& candidate_set,
                                           const Explanation& explanation, BlockIndex removed,
                                           const Block& replacement) {
  std::vector<BlockIndex> support = explanation.blocks;
  const BlockIndex added = candidate_set.Add(replacement);
  if (std::ranges::find(support, added) != support.end()) return std::nullopt;
  std::replace(support.begin(), support.end(), removed, added);
  std::ranges::sort(support);
  std::vector<const Block*> blocks;
  for (const BlockIndex block : support) blocks.push_back(&candidate_set.blocks()[block]);
  if (ShapesConflict(candidate_set.problem(), blocks)) return std::nullopt;
  return candidate_set.Fit(support);
}

std::vector<Explanation> AliasesOf(CandidateSet& candidate_set, const Explanation& explanation) {
  std::vector<Explanation> aliases;
  for (const BlockIndex block : explanation.blocks) {
    const Block line_block = candidate_set.blocks()[block];  // a copy: Add() moves the blocks
    const std::optional<PeriodicLine> line = LineOf(line_block);
    if (!line) continue;
    std::size_t added = 0;
    for (const double cycles : AliasedCycles(candidate_set.problem(), *line)) {
      if (added == kMaxAliases) break;
      auto alias = WithReplacement(candidate_set, explanation, block, LineAt(line_block, cycles));
      if (!alias) continue;
      aliases.push_back(*std::move(alias));
      ++added;
    }
  }
  return aliases;
}

/// Readings of a joint that are multiples of 2 pi / n apart cannot distinguish c cycles per turn
/// from |m n - c| or m n + c for any integer m: the lines coincide at the readings and differ only
/// between them. Adds, for every line of the answer and of the explanations that score nearly as
/// well, the explanations with the slowest such lines in its place; `ranked` remains sorted by
/// score. Nothing is added if the readings are spread.
/// @param best  the answer, as columns of `candidate_set`
void AddLineAliases(CandidateSet& candidate_set, const Explanation& best,
                    std::vector<Explanation>& ranked) {
  std::vector<Explanation> aliases = AliasesOf(candidate_set, best);
  for (std::size_t k = 0; k < std::min(kMaxExplanations, ranked.size()); ++k) {
    const Explanation other = ranked[k];
    if (other.columns == best.columns || other.score > best.score + kRefitScoreRange) continue;
    for (Explanation& alias : AliasesOf(candidate_set, other)) aliases.push_back(std::move(alias));
  }
  ranked.insert(ranked.end(), aliases.begin(), aliases.end());
  std::ranges::stable_sort(
      ranked, [](const Explanation& a, const Explanation& b) { return a.score < b.score; });
}

constexpr int kPasses = 7;
constexpr int kRestrictedPasses =
    2;  // the first passes allow few effects, so that these do not fit outliers
constexpr std::size_t kRestrictedBlocks = 2;
constexpr std::size_t kMaxRefits = 12;
constexpr double kSameCorrelation = 0.05;
constexpr double kSameChi2 = 0.5;  // a twentieth of the smallest margin between explanations

bool SameSupport(const Model& a, const Model& b) {
  return std::equal(a.effects.begin(), a.effects.end(), b.effects.begin(), b.effects.end(),
                    [](const effects::ActiveEffect& x, const effects::ActiveEffect& y) {
                      return x.term.effect == y.term.effect && x.term.word == y.term.word &&
                             x.term.parameters == y.term.parameters;
                    });
}

/// True if the frames changed so much that the gradients must be recomputed: by more than changes a
/// gradient by a share of 1e-4 (1 um of 10 mm).
bool FramesMoved(const Indexed<SessionIndex, Model::Frames>& before,
                 const Indexed<SessionIndex, Model::Frames>& now) {
  constexpr double kLeast_m = 1e-4, kLeast = 1e-4;
  return !std::equal(before.begin(), before.end(), now.begin(), now.end(),
                     [](const Model::Frames& a, const Model::Frames& b) {
                       return (a.X_WB.p - b.X_WB.p).norm() < kLeast_m &&
                              (a.X_WB.R - b.X_WB.R).norm() < kLeast &&
                              std::equal(a.X_FT.begin(), a.X_FT.end(), b.X_FT.begin(),
                                         [](const Pose& x, const Pose& y) {
                                           return (x.p - y.p).norm() < kLeast_m;
                                         });
                     });
}

/// The same for the places of artefacts. Rows on a point have gradients that do not depend on it.
bool PlacesMoved(const Dataset& data, const Indexed<ArtefactIndex, PlacedArtefact>& before,
                 const Indexed<ArtefactIndex, PlacedArtefact>& now) {
  constexpr double kLeast_m = 1e-4, kLeast = 1e-4;
  const auto directed = [](const Observation& observation) {
    return OnArtefact(observation.kind) && observation.kind != ObservationKind::kPoint;
  };
  if (std::ranges::none_of(data.observations, directed)) return false;
  return !std::equal(before.begin(), before.end(), now.begin(), now.end(),
                     [](const PlacedArtefact& a, const PlacedArtefact& b) {
                       return (a.place - b.place).norm() < kLeast_m &&
                              (a.direction - b.direction).norm() < kLeast;
                     });
}

/// Weighted RMS of one axis, corrected for the number of parameters.
double WeightedSigma(const FitProblem& problem, const PerRow<RowResidual>& residuals,
                     double parameters) {
  double sum = 0, count = 0;
  for (const RowIndex row : residuals.indices()) {
    const RowNumbers& numbers = problem.data.numbers[row];
    sum += problem.weights[row] * SquareOf(numbers, residuals[row]);
    count += problem.weights[row] * numbers.count;
  }
  return std::sqrt(sum / std::max(1.0, count - parameters));
}

/// Largest change of chi2 by new weights: the sum of the changes, all taken as positive.
double ChangeOfChi2(const FitProblem& problem, const PerRow<double>& before,
                    const PerRow<RowResidual>& residuals) {
  double change = 0;
  for (const RowIndex row : residuals.indices()) {
    const double of_weight = std::abs(problem.weights[row] - before[row]);
    if (of_weight > 0) change += of_weight * SquareOf(problem.data.numbers[row], residuals[row]);
  }
  return change / (problem.sigma_m * problem.sigma_m);
}

/// Residual standard deviation of one axis with all effects fitted at once; nullopt if there are
/// too few rows.
std::optional<double> SigmaOfFullFit(const CandidateSet& candidate_set,
                                     const Candidates& candidates, CandidateSet& scratch) {
  const Explanation full_fit = scratch.Fit(scratch.Add(candidates.blocks));
  const double freedom =
      candidate_set.problem().freedom() - static_cast<double>(full_fit.columns.size());
  if (freedom < 12) return std::nullopt;
  return candidate_set.problem().sigma_m() * std::sqrt(full_fit.chi2 / freedom);
}

Result<Refit> RefitTo(const Identified& so_far, const Explanation& explanation) {
  Model start = so_far.model;
  start.effects = EffectsFrom(so_far.fit.data, so_far.candidate_set->blocks(),
                              so_far.candidate_set->CoefficientsOf(explanation));
  return RefitModel(so_far.fit, start, {});
}

/// Replaces the best explanation by another one that predicts the rows which the best one rejects.
/// A row measured to separate two explanations is an apparent gross error of the wrong one.
void PreferFewerRejections(Identified& so_far, Refit& refit) {
  const Dataset& data = so_far.fit.data;
  const PerRow<double>& weights = so_far.fit.weights;
  const auto rejected = [](double weight) { return weight < kOutlierWeight; };
  if (so_far.unknown || std::ranges::none_of(weights, rejected)) return;
  const auto cost = [&](const Refit& tried, const Explanation& explanation) {
    const Result<Linearisation> linear = Linearise(data, tried.model, false, so_far.fit.threads);
    if (!linear) return 1e300;
    return HampelLoss(data, ResidualsOf(*linear), so_far.fit.sigma_m) + explanation.score -
           explanation.chi2;
  };
  const double worst_score = so_far.best.score + kRefitScoreRange;
  double least = cost(refit, so_far.best) - kRejectionMargin;
  for (std::size_t k = 0; k < std::min(kMaxRefits, so_far.ranked.size()); ++k) {
    const Explanation& other = so_far.ranked[k];
    if (other.score > worst_score) break;
    if (other.blocks.empty() || other.columns == so_far.best.columns) continue;
    const Result<Refit> of_other = RefitTo(so_far, other);
    if (!of_other) continue;
    const double value = cost(*of_other, other);
    if (value >= least) continue;
    least = value;
    so_far.best = other;
    refit = *of_other;
  }
}

/// Searches at the current linearisation and refits the best explanation that can be refitted.
Result<Refit> SearchAndRefit(std::size_t most, bool with_unknown, const DiagnosisOptions& options,
                             Identified& so_far) {
  so_far.candidate_set.reset();
  so_far.problem = std::make_unique<LinearProblem>(so_far.fit, so_far.linear, so_far.model);
  so_far.candidate_set = std::make_unique<CandidateSet>(*so_far.problem);
  Candidates candidates = so_far.candidates;
  for (Block& block : BlocksOf(so_far.fit.data, so_far.model.effects)) {
    candidates.blocks.push_back(std::move(block));
  }
  so_far.ranked = Search(*so_far.candidate_set, candidates, most, options.interrupted);
  // An empirical term competes with catalogue explanations of every depth.
  const Explanation extended =
      with_unknown ? WithUnknown(*so_far.candidate_set, so_far.ranked) : so_far.ranked.front();
  const bool empirical = HasEmpirical(*so_far.candidate_set, extended);
  const double margin = empirical ? kUnknownMargin : 0;  // none between effects of the catalogue
  const bool better = extended.score < so_far.ranked.front().score - margin;
  so_far.unknown = better && empirical;
  so_far.best = better ? extended : so_far.ranked.front();
  Result<Refit> refit = RefitTo(so_far, so_far.best);
  // If the refit fails, the linear fit was misleading: use the next explanation.
  for (std::size_t next = better ? 0 : 1;
       !refit && next < std::min(kMaxRefits, so_far.ranked.size()); ++next) {
    so_far.best = so_far.ranked[next];
    so_far.unknown = false;
    refit = RefitTo(so_far, so_far.best);
  }
  if (!refit) {
    so_far.best = so_far.candidate_set->Fit({});
    so_far.unknown = false;
    refit = RefitTo(so_far, so_far.best);
  }
  if (refit) PreferFewerRejections(so_far, refit.value());
  return refit;
}

/// Like SearchAndRefit, without units that became superfluous after the refit and without events
/// supported only by outliers.
Result<Refit> SearchRefitAndEliminate(std::size_t most, bool with_unknown,
                                      const DiagnosisOptions& options, Identified& so_far) {
  Result<Refit> refit = SearchAndRefit(most, with_unknown, options, so_far);
  if (!refit) return refit;
  RefittedExplanation kept = EliminateUnsupportedUnits(
      *so_far.candidate_set, {std::move(so_far.best), std::move(refit).value()},
      [&so_far](const Explanation& explanation) { return RefitTo(so_far, explanation); });
  const auto refit_with = [&so_far](const FitProblem& fit, const Explanation& explanation) {
    Model start = so_far.model;
    start.effects = EffectsFrom(fit.data, so_far.candidate_set->blocks(),
                                so_far.candidate_set->CoefficientsOf(explanation));
    return RefitModel(fit, start, {});
  };
  WithoutOutlierEvents tested =
      DropOutlierEvents(so_far.fit, *so_far.candidate_set, std::move(kept), refit_with);
  so_far.many_outliers = so_far.many_outliers || tested.dropped;
  so_far.best = std::move(tested.kept.explanation);
  return std::move(tested.kept.refit);
}

/// Scale of the robust weights: the scatter, or a larger value at which one row in ten is rejected.
double ScaleOfWeights(const Identified& found, const PerRow<RowResidual>& residuals,
                      double scatter) {
  const Dataset& data = found.fit.data;
  const double scale = std::max(scatter, data.sigma_m);
  return found.many_outliers ? scale : OutlierScale(data, residuals, scale);
}

}  // namespace

Result<Identified> Identify(const Dataset& data, const Model& aligned,
                            const DiagnosisOptions& options,
                            const std::function<void(double, const std::string&)>& progress,
                            std::size_t most) {
  Identified found(UnitWeightFit(data, options.threads));
  found.candidates = CandidatesFor(data);
  found.aligned = found.model = aligned;
  const auto linearise = [&]() -> std::optional<std::string> {
    const bool moved = FramesMoved(found.linear_frames, found.model.frames) ||
                       PlacesMoved(data, found.linear_places, found.model.artefacts);
    if (moved) {
      found.linear_frames = found.model.frames;
      found.linear_places = found.model.artefacts;
    }
    Result<Linearisation> linear =
        LineariseApart(data, found.model, options.threads, moved ? nullptr : found.linear.get());
    if (!linear) return linear.error();
    found.linear = std::make_shared<const Linearisation>(std::move(linear).value());
    return std::nullopt;
  };
  if (const auto fault = linearise()) return Error{*fault};
  PerRow<RowResidual> residuals = ResidualsOf(*found.linear);
  double scatter = RobustSigma(data, residuals);
  found.fit.sigma_m = std::max({data.sigma_m, scatter, 1e-7});
  found.fit.weights =
      HampelWeights(data, residuals, OutlierScale(data, residuals, found.fit.sigma_m));
  std::optional<double> full_fit_sigma;

  for (int pass = 0; pass < kPasses; ++pass) {
    if (options.interrupted && options.interrupted()) return Error{"interrupted"};
    progress(static_cast<double>(pass) / kPasses,
             fmt::format("searching effects, pass {}", pass + 1));
    const bool restricted = pass < kRestrictedPasses;
    const Result<Refit> refit = SearchRefitAndEliminate(
        restricted ? std::min(kRestrictedBlocks, most) : most, pass > 0, options, found);
    if (!refit) return Error{refit.error()};
    const bool same_support = !restricted && SameSupport(refit->model, found.model);
    found.refit = *refit;
    found.model = refit->model;
    if (const auto fault = linearise()) return Error{*fault};
    residuals = ResidualsOf(*found.linear);
    scatter = RobustSigma(data, residuals);
    const PerRow<double> before = found.fit.weights;
    found.fit.weights = HampelWeights(data, residuals, ScaleOfWeights(found, residuals, scatter));
    scatter = std::max(scatter, WeightedSigma(found.fit, residuals,
                                              static_cast<double>(found.best.columns.size())));
    if (pass >= kRestrictedPasses - 1) {
      CandidateSet scratch(*found.problem);
      full_fit_sigma = SigmaOfFullFit(*found.candidate_set, found.candidates, scratch);
    }
    const double sigma =
        std::max({data.sigma_m, std::min(full_fit_sigma.value_or(scatter), scatter), 1e-7});
    // With few effects allowed, the residual still contains real effects, which look like
    // correlation.
    const double correlation = restricted ? 0 : RowCorrelation(data, residuals, found.fit.weights);
    const bool converged = std::abs(sigma - found.fit.sigma_m) < 0.03 * sigma &&
                           std::abs(correlation - found.fit.row_correlation) < kSameCorrelation &&
                           ChangeOfChi2(found.fit, before, residuals) < kSameChi2;
    if (same_support && converged) {  // its chi2 and costs refer to the current noise
      AddLineAliases(*found.candidate_set, found.best, found.ranked);
      return found;
    }
    found.fit.sigma_m = sigma;
    found.fit.row_correlation = correlation;
  }
  // Not converged: final selection with the final weights.
  const Result<Refit> refit = SearchRefitAndEliminate(most, true, options, found);
  if (!refit) return Error{refit.error()};
  found.refit = *refit;
  found.model = refit->model;
  if (const auto fault = linearise()) return Error{*fault};
  AddLineAliases(*found.candidate_set, found.best, found.ranked);
  return found;
}

Result<Linearisation> LineariseApart(const Dataset& data, const Model& model, int threads,
                                     const Linearisation* before) {
  Model bare = model;
  bare.effects.clear();
  Result<Linearisation> linear =
      before != nullptr ? Result<Linearisation>(*before) : Linearise(data, bare, true, threads);
  if (!linear || (model.effects.empty() && before == nullptr)) return linear;
  Result<Linearisation> full = Linearise(data, model, false, threads);
  if (!full) return full;
  Linearisation apart = *linear;
  for (const RowIndex row : apart.rows.indices()) {
    apart.rows[row].residual = full->rows[row].residual;
    apart.rows[row].p_W = full->rows[row].p_W;
  }
  return apart;
}

double ParametersOf(const Identified& found, const Dataset& data) {
  const Nuisances nuisances(data);
  return static_cast<double>(found.best.columns.size()) + nuisances.size() - nuisances.equations();
}

}  // namespace plumbline::measure
