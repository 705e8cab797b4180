#include "app/diagnosis/hidden_mistakes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/diagnosis_text.h"
#include "app/diagnosis/mistakes.h"
#include "app/diagnosis/plausibility.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/thresholds.h"
#include "app/diagnosis/unit_changes.h"

namespace plumbline::diagnosis {
namespace {

constexpr int kRows = 300;  // a judgement; bounds the time on large tables

double ResidualSigma(const Identified& found) {
  return RobustSigma(found.fit.data, ResidualsOf(*found.linear));
}

/// True where the answer needs no mistake to be believed.
bool IsSound(const Identified& found) {
  const Dataset& data = found.fit.data;
  const auto& effects = found.refit.model.effects;
  return !found.unknown && ResidualSigma(found) < kExcessNoiseRatio * data.sigma_m &&
         std::all_of(effects.begin(), effects.end(), [&data](const effects::ActiveEffect& effect) {
           return ImplausibilityOf(data, effect).sentence.empty();
         });
}

/// What an answer's effects cost where successive rows are correlated by so much.
double CostAt(const Identified& found, double row_correlation) {
  FitProblem fit = found.fit;
  fit.row_correlation = row_correlation;
  const LinearProblem problem(std::move(fit), found.linear, found.model);
  CandidateSet candidate_set(problem);
  std::vector<ColumnIndex> columns;
  for (const BlockIndex block : found.best.blocks) {
    const BlockIndex own = candidate_set.Add(found.candidate_set->blocks()[block]);
    for (const ColumnIndex column : candidate_set.ColumnsOf({own})) {
      const bool kept = std::any_of(
          found.best.columns.begin(), found.best.columns.end(), [&](ColumnIndex of_best) {
            return found.candidate_set->BlockOfColumn(of_best) == block &&
                   found.candidate_set->UnitOfColumn(of_best) == candidate_set.UnitOfColumn(column);
          });
      if (kept) columns.push_back(column);
    }
  }
  std::sort(columns.begin(), columns.end());
  const Explanation explanation = candidate_set.FitColumns(columns);
  return explanation.score - explanation.chi2;
}

/// chi2 at the declared noise, bounded for rejected rows, and the cost of the effects at a
/// correlation from row to row: two answers compare by it whatever each takes the noise for.
double ScoreAt(const Identified& found, double row_correlation) {
  const Dataset& data = found.fit.data;
  return HampelLoss(data, ResidualsOf(*found.linear), data.sigma_m) +
         CostAt(found, row_correlation);
}

/// The score of an answer's own effects on rows that may be changed: linear, with the answer's
/// noise and every row's whole weight, so that two scores compare; infinite where the rows cannot
/// be aligned.
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

Result<Identified> IdentifyAnew(const Dataset& data, std::size_t most,
                                const DiagnosisOptions& options, const Progress& tell) {
  const Result<Model> aligned = Align(data, Model::Declared(data), options.threads);
  if (!aligned) return Error{aligned.error()};
  return Identify(data, *aligned, options, tell, most);
}

struct Corrected {
  const Mistake* mistake = nullptr;
  Dataset rows;
};

/// The mistakes that are worth a search of their own: those with which the answer's own effects, or
/// some of them, do better.
std::vector<Corrected> WorthASearch(const Identified& found, const std::vector<Mistake>& mistakes,
                                    const Dataset& few, const DiagnosisOptions& options) {
  const double to_beat = ScoreOfOwnEffects(found, few, options) - kMistakeMargin;
  std::vector<Corrected> worth;
  for (const Mistake& mistake : mistakes) {
    if (!mistake.subtle) continue;
    Corrected corrected{&mistake, few};
    mistake.undo(corrected.rows);
    const double score = ScoreOfOwnEffects(found, corrected.rows, options);
    if (score > to_beat) continue;
    const bool no_better_than_beside = std::any_of(
        mistake.beside.begin(), mistake.beside.end(), [&](const std::function<void(Dataset&)>& to) {
          Dataset changed = few;
          to(changed);
          return ScoreOfOwnEffects(found, changed, options) < score + kMistakeMargin;
        });
    if (!no_better_than_beside) worth.push_back(std::move(corrected));
  }
  return worth;
}

std::string SentenceOf(const Mistake& mistake, const Identified& without) {
  std::vector<std::string> names;
  for (const effects::ActiveEffect& effect : without.refit.model.effects) {
    names.push_back(EffectName(effect.term.effect->traits().id));
  }
  const std::string who = names.empty()       ? "the declared cell leaves"
                          : names.size() == 1 ? names.front() + " leaves"
                                              : Listed(names) + " leave";
  return fmt::format(
      "{}: {}. With this corrected, {} no more than the noise of {:.3g} mm on one axis; as "
      "recorded, "
      "the rows need more effects or leave a larger residual",
      mistake.sentence, mistake.remedy, who, 1e3 * without.fit.data.sigma_m);
}

/// Progress of one search of several.
Progress PartOf(const Progress& tell, std::size_t part, std::size_t parts) {
  return [&tell, part, parts](double share, const std::string&) {
    tell((static_cast<double>(part) + share) / static_cast<double>(parts),
         "asking for a mistake beside the effects");
  };
}

/// True where the corrected answer's own effects do as well with a change beside the mistake.
bool AsWellBeside(const Mistake& mistake, const Identified& without, const Dataset& few,
                  const DiagnosisOptions& options) {
  const double own = ScoreOfOwnEffects(without, without.fit.data, options);
  return std::any_of(mistake.beside.begin(), mistake.beside.end(),
                     [&](const std::function<void(Dataset&)>& to) {
                       Dataset changed = few;
                       to(changed);
                       return ScoreOfOwnEffects(without, changed, options) < own + kMistakeMargin;
                     });
}

}  // namespace

std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options,
                                         const Progress& tell) {
  if (!(found.fit.data.sigma_m > 0) || found.best.blocks.empty()) return std::nullopt;
  const std::vector<Mistake> mistakes = MistakesOf(found.fit.data);
  const Dataset few = SelectRows(found.fit.data, EvenlySpacedRows(found.fit.data, kRows));
  const std::vector<Corrected> worth = WorthASearch(found, mistakes, few, options);
  if (worth.empty()) return std::nullopt;
  const std::size_t searches = worth.size() + 1;
  const Result<Identified> as_it_is =
      IdentifyAnew(few, kMaxBlocks, options, PartOf(tell, 0, searches));
  if (!as_it_is) return std::nullopt;
  const double chosen_among = 2 * std::log(static_cast<double>(worth.size()));
  for (std::size_t k = 0; k < worth.size(); ++k) {
    // What needs more effects than the answer that it replaces is no better.
    const Result<Identified> without = IdentifyAnew(worth[k].rows, as_it_is->best.blocks.size(),
                                                    options, PartOf(tell, k + 1, searches));
    if (!without || !IsSound(*without)) continue;
    // What fits leaves the noise as it is: its correlation counts for both.
    const double correlation = without->fit.row_correlation;
    const double to_beat = ScoreAt(*as_it_is, correlation) - kMistakeMargin - chosen_among;
    if (ScoreAt(*without, correlation) > to_beat) continue;
    return SentenceOf(*worth[k].mistake, *without);
  }
  return std::nullopt;
}

std::optional<std::string> HiddenUnitChange(const Dataset& data, const DiagnosisOptions& options,
                                            const Progress& tell) {
  if (!(data.sigma_m > 0)) return std::nullopt;
  constexpr std::size_t kFewEffects = 3;
  const std::vector<Mistake> mistakes = UnitChanges(data);
  const Dataset few = SelectRows(data, EvenlySpacedRows(data, kRows));
  const std::size_t searches = 2 * mistakes.size();
  const double chosen_among = 2 * std::log(std::max(1.0, static_cast<double>(mistakes.size())));
  for (std::size_t k = 0; k < mistakes.size(); ++k) {
    Dataset converted = few;
    mistakes[k].undo(converted);
    const Result<Identified> without =
        IdentifyAnew(converted, kFewEffects, options, PartOf(tell, 2 * k, searches));
    if (!without || !IsSound(*without)) continue;
    const std::size_t as_many = std::max<std::size_t>(1, without->best.blocks.size());
    const Result<Identified> as_read =
        IdentifyAnew(few, as_many, options, PartOf(tell, 2 * k + 1, searches));
    const double correlation = without->fit.row_correlation;
    const double to_beat = as_read ? ScoreAt(*as_read, correlation) : HUGE_VAL;
    if (ScoreAt(*without, correlation) > to_beat - kMistakeMargin - chosen_among) continue;
    if (!AsWellBeside(mistakes[k], *without, few, options)) {
      return SentenceOf(mistakes[k], *without);
    }
  }
  return std::nullopt;
}

}  // namespace plumbline::diagnosis
