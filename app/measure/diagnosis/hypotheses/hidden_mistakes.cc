#include "app/measure/diagnosis/hypotheses/hidden_mistakes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/hypotheses/mistakes.h"
#include "app/measure/diagnosis/hypotheses/unit_segment.h"
#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/plausibility.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"

namespace plumbline::measure {
namespace {

constexpr int kMaxSearchedRows = 300;  // a judgement; limits the computing time for large tables

Dataset Searched(const Dataset& data) {
  return SelectRows(data, EvenlySpacedRows(data, kMaxSearchedRows));
}

double ResidualSigma(const Identified& found) {
  return RobustSigma(found.fit.data, ResidualsOf(*found.linear));
}

/// True if the answer is credible: no empirical term, no implausible value, residual within the
/// noise.
bool IsSound(const Identified& found) {
  const Dataset& data = found.fit.data;
  const auto& effects = found.refit.model.effects;
  return !found.unknown && ResidualSigma(found) < kExcessNoiseRatio * data.sigma_m &&
         std::ranges::all_of(effects, [&data](const effects::ActiveEffect& effect) {
           return ImplausibilityOf(data, effect).sentence.empty();
         });
}

/// Cost of an answer's effects at a given correlation of successive rows.
double CostAt(const Identified& found, double row_correlation) {
  FitProblem fit = found.fit;
  fit.row_correlation = row_correlation;
  const LinearProblem problem(std::move(fit), found.linear, found.model);
  CandidateSet candidate_set(problem);
  std::vector<ColumnIndex> columns;
  for (const BlockIndex block : found.best.blocks) {
    const BlockIndex own = candidate_set.Add(found.candidate_set->blocks()[block]);
    for (const ColumnIndex column : candidate_set.ColumnsOf({own})) {
      const bool kept = std::ranges::any_of(found.best.columns, [&](ColumnIndex of_best) {
        return found.candidate_set->BlockOfColumn(of_best) == block &&
               found.candidate_set->UnitOfColumn(of_best) == candidate_set.UnitOfColumn(column);
      });
      if (kept) columns.push_back(column);
    }
  }
  std::ranges::sort(columns);
  const Explanation explanation = candidate_set.FitColumns(columns);
  return explanation.score - explanation.chi2;
}

/// Score with common assumptions, by which two answers are comparable whatever noise each
/// estimated: chi2 at the declared noise, bounded for rejected rows, plus the cost of the effects
/// at a given row correlation.
double ScoreAt(const Identified& found, double row_correlation) {
  const Dataset& data = found.fit.data;
  return HampelLoss(data, ResidualsOf(*found.linear), data.sigma_m) +
         CostAt(found, row_correlation);
}

/// Score of an answer's effects on (possibly corrected) rows: a linear fit with the answer's noise
/// and unit weights, so that two scores are comparable. Infinite if the rows cannot be aligned.
double ScoreOfOwnEffects(const Identified& found, const Dataset& rows,
                         const DiagnosisOptions& options) {
  const Result<Model> aligned = Align(rows, Model::Declared(rows), options.threads);
  if (!aligned) return HUGE_VAL;
  const Result<Linearisation> linear = LineariseApart(rows, *aligned, options.threads);
  if (!linear) return HUGE_VAL;
  FitProblem fit = UnitWeightFit(rows, options.threads);
  fit.sigma_m = found.fit.sigma_m;
  const LinearProblem problem(fit, std::make_shared<const Linearisation>(*linear), *aligned);
  CandidateSet candidate_set(problem);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  return candidate_set.Evaluate(support).score;
}

Result<Identified> AlignAndIdentify(const Dataset& data, std::size_t most,
                                    const DiagnosisOptions& options, const Progress& progress) {
  const Result<Model> aligned = Align(data, Model::Declared(data), options.threads);
  if (!aligned) return Error{aligned.error()};
  return Identify(data, *aligned, options, progress, most);
}

struct Corrected {
  const Mistake* mistake = nullptr;
  Dataset rows;
};

/// The mistakes that justify a search: correcting them improves the fit of the answer's effects, or
/// of some of them.
std::vector<Corrected> PromisingMistakes(const Identified& found,
                                         const std::vector<Mistake>& mistakes, const Dataset& all,
                                         const Dataset& subset, const DiagnosisOptions& options) {
  const double to_beat = ScoreOfOwnEffects(found, subset, options) - kMistakeMargin;
  std::vector<Corrected> promising;
  for (const Mistake& mistake : mistakes) {
    if (!mistake.subtle) continue;
    Corrected corrected{&mistake, mistake.needs_all_rows ? all : subset};
    mistake.undo(corrected.rows);
    if (mistake.needs_all_rows) corrected.rows = Searched(corrected.rows);
    const double score = ScoreOfOwnEffects(found, corrected.rows, options);
    if (score > to_beat) continue;
    const bool alternative_fits_as_well =
        std::ranges::any_of(mistake.alternatives, [&](const std::function<void(Dataset&)>& to) {
          Dataset changed = subset;
          to(changed);
          return ScoreOfOwnEffects(found, changed, options) < score + kMistakeMargin;
        });
    if (!alternative_fits_as_well) promising.push_back(std::move(corrected));
  }
  return promising;
}

std::string SentenceOf(const Mistake& mistake, const Identified& without) {
  std::vector<std::string> names;
  for (const effects::ActiveEffect& effect : without.refit.model.effects) {
    names.push_back(EffectName(effect.term.effect->traits().id));
  }
  const std::string subject = names.empty()       ? "the declared cell leaves"
                              : names.size() == 1 ? names.front() + " leaves"
                                                  : Listed(names) + " leave";
  return fmt::format(
      "{}: {}. With this corrected, {} no more than the noise of {:.3g} mm on one axis; as "
      "recorded, the rows need more effects or leave a larger residual",
      mistake.sentence, mistake.remedy, subject, 1e3 * without.fit.data.sigma_m);
}

/// Progress callback for one of several searches.
Progress PartOf(const Progress& progress, std::size_t part, std::size_t parts) {
  return [&progress, part, parts](double share, const std::string&) {
    progress((static_cast<double>(part) + share) / static_cast<double>(parts),
             "checking the data for mistakes");
  };
}

/// The units that the effects of a few causes can confirm, without gross errors.
std::vector<Mistake> SubtleUnits(const Dataset& data) {
  std::vector<Mistake> mistakes = UnitChanges(data);
  if (auto fahrenheit = FahrenheitMistake(data)) mistakes.push_back(*std::move(fahrenheit));
  return mistakes;
}

/// True if the effects of the corrected answer fit as well with an alternative change.
bool AlternativeFitsAsWell(const Mistake& mistake, const Identified& without, const Dataset& subset,
                           const DiagnosisOptions& options) {
  const double own = ScoreOfOwnEffects(without, without.fit.data, options);
  return std::ranges::any_of(mistake.alternatives, [&](const std::function<void(Dataset&)>& to) {
    Dataset changed = subset;
    to(changed);
    return ScoreOfOwnEffects(without, changed, options) < own + kMistakeMargin;
  });
}

}  // namespace

std::optional<std::string> HiddenMistake(const Identified& found, const Dataset& data,
                                         const DiagnosisOptions& options,
                                         const Progress& progress) {
  if (!(data.sigma_m > 0) || found.best.blocks.empty()) return std::nullopt;
  const std::vector<Mistake> mistakes = MistakesOf(data);
  const Dataset subset = Searched(data);
  const std::vector<Corrected> promising =
      PromisingMistakes(found, mistakes, data, subset, options);
  if (promising.empty()) return std::nullopt;
  const std::size_t searches = promising.size() + 1;
  const Result<Identified> uncorrected =
      AlignAndIdentify(subset, kMaxBlocks, options, PartOf(progress, 0, searches));
  if (!uncorrected) return std::nullopt;
  const double choice_cost = 2 * std::log(static_cast<double>(promising.size()));
  for (std::size_t k = 0; k < promising.size(); ++k) {
    // An explanation with more effects than the answer that it replaces is no improvement.
    const Result<Identified> without =
        AlignAndIdentify(promising[k].rows, uncorrected->best.blocks.size(), options,
                         PartOf(progress, k + 1, searches));
    if (!without || !IsSound(*without)) continue;
    // The residual of the better fit shows the true noise, so its correlation is used for both.
    const double correlation = without->fit.row_correlation;
    const double to_beat = ScoreAt(*uncorrected, correlation) - kMistakeMargin - choice_cost;
    if (ScoreAt(*without, correlation) > to_beat) continue;
    return SentenceOf(*promising[k].mistake, *without);
  }
  return std::nullopt;
}

std::optional<std::string> HiddenUnitChange(const Dataset& data, const DiagnosisOptions& options,
                                            const Progress& progress) {
  if (!(data.sigma_m > 0)) return std::nullopt;
  constexpr std::size_t kFewEffects = 3;
  const std::vector<Mistake> mistakes = SubtleUnits(data);
  const Dataset subset = Searched(data);
  const std::size_t searches = 2 * mistakes.size();
  const double choice_cost = 2 * std::log(std::max(1.0, static_cast<double>(mistakes.size())));
  for (std::size_t k = 0; k < mistakes.size(); ++k) {
    Dataset converted = subset;
    mistakes[k].undo(converted);
    const Result<Identified> without =
        AlignAndIdentify(converted, kFewEffects, options, PartOf(progress, 2 * k, searches));
    if (!without || !IsSound(*without)) continue;
    const std::size_t as_many = std::max<std::size_t>(1, without->best.blocks.size());
    const Result<Identified> as_read =
        AlignAndIdentify(subset, as_many, options, PartOf(progress, 2 * k + 1, searches));
    const double correlation = without->fit.row_correlation;
    const double to_beat = as_read ? ScoreAt(*as_read, correlation) : HUGE_VAL;
    if (ScoreAt(*without, correlation) > to_beat - kMistakeMargin - choice_cost) continue;
    if (!AlternativeFitsAsWell(mistakes[k], *without, subset, options)) {
      return SentenceOf(mistakes[k], *without);
    }
  }
  return std::nullopt;
}

}  // namespace plumbline::measure
