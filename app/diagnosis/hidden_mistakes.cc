#include "app/diagnosis/hidden_mistakes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/alignment.h"
#include "app/diagnosis/mistakes.h"
#include "app/diagnosis/plausibility.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/thresholds.h"
#include "app/diagnosis/words.h"

namespace plumbline {
namespace {

constexpr int kRows = 300;  // enough to tell, and a fraction of a search's time

double ResidualSigma(const Identified& found) {
  return RobustSigma(found.fit.data, ResidualsOf(*found.linear));
}

/// True where the answer needs no mistake to be believed.
bool IsSound(const Identified& found) {
  const Dataset& data = found.fit.data;
  const auto& effects = found.refit.model.effects;
  return !found.unknown && ResidualSigma(found) < kRough * data.sigma_m &&
         std::all_of(effects.begin(), effects.end(), [&data](const ActiveEffect& effect) {
           return ImplausibilityOf(data, effect).sentence.empty();
         });
}

/// chi2 at the declared noise, bounded for rejected rows, and the cost of the effects: two answers
/// compare by it whatever each takes the noise for.
double ScoreAtDeclaredNoise(const Identified& found) {
  const Dataset& data = found.fit.data;
  return HampelLoss(data, ResidualsOf(*found.linear), data.sigma_m) + found.best.score -
         found.best.chi2;
}

Result<Identified> IdentifyAnew(const Dataset& data, const DiagnosisOptions& options) {
  const Result<Model> aligned = Aligned(data, Model::Declared(data), options.threads);
  if (!aligned) return Error{aligned.error()};
  return Identify(data, *aligned, options, [](double, const std::string&) {});
}

}  // namespace

std::optional<std::string> HiddenMistake(const Identified& found, const DiagnosisOptions& options) {
  if (!(found.fit.data.sigma_m > 0) || IsSound(found)) return std::nullopt;
  std::vector<Mistake> mistakes = MistakesOf(found.fit.data);
  std::erase_if(mistakes, [](const Mistake& mistake) { return !mistake.subtle; });
  if (mistakes.empty()) return std::nullopt;
  const Dataset few = Thinned(found.fit.data, EvenlySpread(found.fit.data, kRows));
  const Result<Identified> as_it_is = IdentifyAnew(few, options);
  if (!as_it_is) return std::nullopt;
  const double chosen_among = 2 * std::log(static_cast<double>(mistakes.size()));
  const double to_beat = ScoreAtDeclaredNoise(*as_it_is) - kMistakeMargin - chosen_among;
  for (const Mistake& mistake : mistakes) {
    Dataset mended = few;
    mistake.undo(mended);
    const Result<Identified> without = IdentifyAnew(mended, options);
    if (!without || !IsSound(*without) || ScoreAtDeclaredNoise(*without) > to_beat) continue;
    std::vector<std::string> names;
    for (const ActiveEffect& effect : without->refit.model.effects) {
      names.push_back(EffectName(effect.term.effect->traits().id));
    }
    return fmt::format(
        "{}: {}. With it {} the noise of {:.3g} mm; as the rows are, what explains them is no "
        "sound "
        "machine's, or leaves more than the noise",
        mistake.sentence, mistake.remedy,
        names.empty()
            ? "the declared cell leaves no more than"
            : Listed(names) + (names.size() == 1 ? " leaves" : " leave") + " no more than",
        1e3 * few.sigma_m);
  }
  return std::nullopt;
}

}  // namespace plumbline
