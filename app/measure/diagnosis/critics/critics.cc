#include "app/measure/diagnosis/critics/critics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/measure/diagnosis/critics/lack_of_fit.h"
#include "app/measure/diagnosis/critics/misfit.h"
#include "app/measure/diagnosis/critics/open_world.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/result/opinion.h"

namespace plumbline::measure {
namespace {

Opinion Note(std::string note) {
  Opinion opinion;
  opinion.notes.push_back(std::move(note));
  return opinion;
}

/// Effects that are easily confused with the findings, but that these rows cannot test.
Opinion OpinionOnUntested(const Candidates& candidates, const std::vector<Finding>& findings) {
  std::vector<std::string> untested;
  for (const ExcludedCandidate& excluded : candidates.excluded) {
    const auto confused = [&](const Finding& finding) {
      const auto& ids = finding.effect.term.effect->traits().confused_with;
      return std::ranges::find(ids, excluded.id) != ids.end();
    };
    if (!excluded.real || std::ranges::none_of(findings, confused)) continue;
    untested.push_back(fmt::format("{} ({})", EffectName(excluded.id), excluded.reason));
  }
  if (untested.empty()) return {};
  return Note(
      fmt::format("easily confused with the named effects, but not testable with these rows: {}",
                  Listed(untested)));
}

/// Sizes of effects that these rows cannot show.
Opinion OpinionOnUndetectable(const Diagnosis& answer) {
  std::vector<std::string> undetectable;
  for (const NotObservable& sizes : answer.not_observable) {
    if (sizes.parameters.empty()) continue;  // not an effect
    const bool some = answer.minimum_detectable_m.contains(sizes.id);
    undetectable.push_back(
        some ? fmt::format("{} ({})", EffectName(sizes.id), fmt::join(sizes.parameters, ", "))
             : EffectName(sizes.id));
  }
  if (undetectable.empty()) return {};
  return Note(fmt::format(
      "not detectable in these rows at any size plausible for a healthy machine (absorbed by free "
      "frames, short lever arms or joints that hardly move): {}",
      fmt::join(undetectable, ", ")));
}

/// What the search itself permits. A curve without a cause is unknown, but ambiguous if the rows
/// leave open which signal it follows.
Opinion OpinionOfSearch(const Identified& found, const Diagnosis& answer) {
  Opinion opinion;
  if (!found.unknown) {
    if (!found.best.blocks.empty()) {
      opinion.permits = answer.rivals.empty() ? Verdict::kExplained : Verdict::kAmbiguous;
    }
    return opinion;
  }
  opinion.permits = answer.rival_drivers.empty() ? Verdict::kUnknown : Verdict::kAmbiguous;
  const auto add = [&](const std::vector<std::string>& columns) {
    opinion.drivers.insert(opinion.drivers.end(), columns.begin(), columns.end());
  };
  for (const BlockIndex block : found.best.blocks) {
    const Block& own = found.candidate_set->blocks()[block];
    if (own.empirical()) add(own.term.drivers);
  }
  for (const std::vector<std::string>& rivals : answer.rival_drivers) add(rivals);
  return opinion;
}

/// Signals that a residual above the noise follows.
Opinion OpinionOnSignals(const Examination& examined) {
  Opinion opinion;
  if (!examined.rough()) return opinion;
  for (const SignalTrace& signal : examined.answer.signals) {
    if (signal.p_value <= kSignalSignificance) opinion.drivers.push_back(signal.name);
  }
  if (!opinion.drivers.empty()) opinion.permits = Verdict::kUnknown;
  return opinion;
}

/// True if the cell or the rows state the noise.
bool NoiseStated(const Dataset& data) {
  return data.cell.measurement.sigma_m || data.row_sigma_m;
}

/// Repeats that scatter more than the declared noise, unless the named effects explain that.
Opinion OpinionOnRepeats(const Examination& examined) {
  constexpr double kMore = 2;
  const Dataset& data = examined.data();
  const bool explained = !examined.rough() && !examined.found.best.blocks.empty();
  if (explained || !NoiseStated(data) || data.repeat_sigma_m <= kMore * data.sigma_m) return {};
  return Note(fmt::format(
      "repeated points scatter by {:.3g} mm, more than {}: check the instrument, or what moved "
      "between the repeats",
      1e3 * data.repeat_sigma_m,
      data.row_sigma_m
          ? fmt::format("the {:.3g} mm of the column sigma_mm (median)", 1e3 * data.sigma_m)
          : fmt::format("the declared sigma_mm = {:.3g}", 1e3 * data.sigma_m)));
}

/// A residual well above the noise. A curve without a cause that leaves one is unknown, whatever it
/// follows.
Opinion OpinionOnResidual(const Examination& examined) {
  if (!examined.rough()) return {};
  const Dataset& data = examined.data();
  Opinion opinion = Note(fmt::format(
      "the residual, {:.3g} mm per axis, is {:.1f} times the noise of {:.3g} mm{}",
      1e3 * examined.residual_sigma_m, examined.residual_sigma_m / data.sigma_m, 1e3 * data.sigma_m,
      data.row_sigma_m ? " (" + data.sigma_origin + ")" : std::string()));
  if (examined.found.unknown) opinion.permits = Verdict::kUnknown;
  return opinion;
}

/// The effects hidden by the joint resolution.
Opinion OpinionOnReadings(const Dataset& data, const Diagnosis& answer) {
  if (data.reading_sigma_m <= 0 || answer.minimum_detectable_m.empty()) return {};
  double least_m = HUGE_VAL;
  for (const auto& [id, size_m] : answer.minimum_detectable_m) least_m = std::min(least_m, size_m);
  return Note(
      fmt::format("with a joint resolution of {:.3g} mrad, no effect below {:.2g} mm (3-D RMS over "
                  "these rows) can be detected",
                  1e3 * data.q_step_rad, 1e3 * least_m));
}

/// Correlated residuals of successive rows.
Opinion OpinionOnCorrelation(const FitProblem& problem) {
  const double rho = problem.row_correlation;
  if (rho <= 0) return {};
  return Note(fmt::format(
      "residuals of successive rows are correlated ({:.2f}): effects that change slowly, "
      "such as an event or a drift, need up to {:.1f} times the evidence",
      rho, (1 + rho) / (1 - rho)));
}

/// In the order in which their sentences appear. None sees what another says.
using Critic = Opinion (*)(const Examination&);
constexpr Critic kCritics[] = {
    [](const Examination& e) { return OpinionOnOpenWorld(e.found); },
    [](const Examination& e) { return OpinionOnUntested(e.found.candidates, e.answer.findings); },
    [](const Examination& e) { return OpinionOnUndetectable(e.answer); },
    [](const Examination& e) { return OpinionOfSearch(e.found, e.answer); },
    OpinionOnSignals,
    OpinionOnRepeats,
    [](const Examination& e) { return OpinionOnMisfit(e.found, e.fit); },
    [](const Examination& e) { return OpinionOnReplicates(e.found, e.fit); },
    [](const Examination& e) { return OpinionOnRejectedRows(e.found); },
    OpinionOnResidual,
    [](const Examination& e) { return OpinionOnReadings(e.data(), e.answer); },
    [](const Examination& e) { return OpinionOnCorrelation(e.found.fit); },
    [](const Examination& e) {
      return OpinionOnReferences(e.without_references, e.found.fit.data.cell, e.useful(),
                                 e.answer.findings);
    },
    [](const Examination& e) { return OpinionOnContradictions(e.references, e.answer); },
    [](const Examination& e) {
      return OpinionOnDeclarations(e.declared_errors, e.found, e.answer.findings);
    },
};

}  // namespace

bool Examination::rough() const {
  return data().sigma_m > 0 && residual_sigma_m >= kExcessNoiseRatio * data().sigma_m;
}

void Criticise(const Examination& examined, Diagnosis& diagnosis) {
  std::vector<Opinion> opinions;
  for (const Critic critic : kCritics) opinions.push_back(critic(examined));
  const bool beyond_stated_noise = examined.rough() && NoiseStated(examined.data());
  FoldOpinions(std::move(opinions), diagnosis);
  diagnosis.declared_noise_too_small =
      beyond_stated_noise && diagnosis.verdict != Verdict::kUnknown;
}

}  // namespace plumbline::measure
