#include "app/measure/diagnosis/headline.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "app/measure/diagnosis/candidates.h"
#include "app/measure/diagnosis/diagnosis_text.h"

namespace plumbline::measure {
namespace {

/// The cycles per turn between which the rows cannot decide for a finding; empty if they can.
std::set<double> UndecidedCycles(const Diagnosis& diagnosis, const Finding& finding) {
  const std::vector<std::string> scope = ScopeOf(finding.effect.term);
  std::set<double> cycles;
  for (const Rival& rival : diagnosis.rivals) {
    if (!rival.cycles || rival.id != finding.effect.term.effect->traits().id) continue;
    if (std::ranges::find(scope, rival.scope.front()) == scope.end()) continue;
    cycles.insert({*rival.cycles, *rival.instead_of_cycles});
  }
  return cycles;
}

/// Sum of the shares of the residual. Correlated effects share what either explains: more than 1.
double SumOfShares(const Diagnosis& diagnosis) {
  double sum = 0;
  for (const Finding& finding : diagnosis.findings) sum += finding.share_of_residual;
  return sum;
}

std::vector<std::string> NamesOf(const Diagnosis& diagnosis, bool with_shares) {
  std::vector<std::string> names;
  if (SumOfShares(diagnosis) > 1) with_shares = false;
  for (const Finding& finding : diagnosis.findings) {
    const effects::EffectTerm& term = finding.effect.term;
    // A rival of the same id is distinguished by its variant.
    const bool differs_by_word = std::ranges::any_of(diagnosis.rivals, [&](const Rival& rival) {
      return !rival.cycles && rival.id == rival.instead_of &&
             rival.id == term.effect->traits().id && rival.instead_of_word == term.word;
    });
    std::string name = differs_by_word
                           ? EffectName(term.effect->traits().id, term.word, ScopeOf(term))
                           : EffectName(finding);
    const std::set<double> cycles = UndecidedCycles(diagnosis, finding);
    if (!cycles.empty()) name += fmt::format(" ({})", CyclesText(cycles));
    if (with_shares) {
      name += fmt::format(" ({}{})", PercentText(finding.share_of_residual),
                          names.empty() ? " of the residual" : "");
    }
    names.push_back(std::move(name));
  }
  return names;
}

/// Clause about a stated noise that is too small for the residual; empty if it is not.
std::string NoiseClause(const Diagnosis& diagnosis) {
  if (!diagnosis.declared_noise_too_small) return "";
  const std::string noise = MillimetreText(diagnosis.noise_floor_m) + " mm";
  const bool of_rows = diagnosis.row_sigma_m.has_value();
  return fmt::format(
      "; the {} is too small for the residual of {} mm: repeat one pose ten times; if those "
      "repeats scatter less than the residual, look for a cause that no recorded signal captures{}",
      of_rows ? "noise of " + noise + " stated in the column sigma_mm"
              : "declared noise of " + noise,
      MillimetreText(diagnosis.rms_after_m), of_rows ? "; otherwise correct the column" : "");
}

std::string NoEffectHeadline(const Diagnosis& diagnosis) {
  const double noise_m =
      diagnosis.declared_noise_too_small ? diagnosis.noise_in_use_m : diagnosis.noise_floor_m;
  std::string text =
      fmt::format("no effect detected above the noise of {} mm", MillimetreText(noise_m));
  const auto& detectable = diagnosis.minimum_detectable_m;
  if (detectable.empty()) return text;
  const auto smaller = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto least = std::ranges::min_element(detectable, smaller);
  const auto most = std::ranges::max_element(detectable, smaller);
  text += fmt::format("; {} mm of {} would have been detected", MillimetreText(least->second),
                      EffectName(least->first));
  if (detectable.size() > 1) {
    text += fmt::format(", and {} mm of any of the {} effects searched for{}",
                        MillimetreText(most->second), detectable.size(),
                        diagnosis.not_observable.empty() ? "" : " that these rows can show");
  }
  return text;
}

/// The alternative driver signals: "t_s or temp_C", or for pairs "t_s and q1_deg or t_s and
/// temp_C".
std::string RivalDrivers(const Diagnosis& diagnosis) {
  std::vector<std::string> choices;
  for (const Finding& finding : diagnosis.findings) {
    const std::vector<std::string>& drivers = finding.effect.term.drivers;
    if (!drivers.empty()) choices.push_back(Listed(drivers));
  }
  for (const std::vector<std::string>& drivers : diagnosis.rival_drivers) {
    choices.push_back(Listed(drivers));
  }
  return Listed(choices, "or");
}

/// That no pose separates the rivals, and how little the choice between them matters; empty if none
/// was searched, for which a note gives the reason.
std::string InseparableClause(const Diagnosis& diagnosis) {
  const auto& separations = diagnosis.rival_separations;
  if (!diagnosis.next_poses_searched || separations.empty()) return "";
  const auto most = std::ranges::max_element(separations, {}, &RivalSeparation::distance_m);
  return fmt::format(
      "; no pose separates them by more than the noise: at {} sampled poses the choice moves the "
      "tip by at most {} mm",
      separations.size(), MillimetreText(most->distance_m));
}

std::string AmbiguousHeadline(const Diagnosis& diagnosis) {
  if (!diagnosis.rival_drivers.empty()) {
    return "an effect outside the catalogue follows " + RivalDrivers(diagnosis) +
           ": these points cannot distinguish which; measure again with the signals varying "
           "independently";
  }
  std::vector<std::string> names = {Listed(NamesOf(diagnosis, false))};
  for (const Rival& rival : diagnosis.rivals) {
    if (rival.cycles) continue;  // in the name of the finding
    std::string name = RivalName(rival);
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  if (diagnosis.rivals.empty()) {
    std::vector<std::string> doubtful;
    for (const Doubt& doubt : diagnosis.doubts) {
      doubtful.push_back(EffectName(doubt.id, doubt.scope));
    }
    const std::size_t all = diagnosis.findings.size();
    const std::string fits = names.front() + (all == 1 ? " fits" : " fit") + " these points, but ";
    if (doubtful.empty()) return fits + "more than the noise is left";
    if (doubtful.size() == all && all == 1) return fits + "is in doubt";
    if (doubtful.size() == all) return fits + (all == 2 ? "both" : "all of them") + " are in doubt";
    return fits + Listed(doubtful) + (doubtful.size() == 1 ? " is" : " are") + " in doubt";
  }
  std::string text = Listed(names, "or") + ": these points cannot distinguish them";
  const std::size_t poses = diagnosis.next_poses.size();
  if (poses == 0) return text + InseparableClause(diagnosis);
  const char* can = diagnosis.next_poses_separate_all ? "would" : "may, but need not";
  if (poses == 1) text += fmt::format("; one further pose {}", can);
  if (poses > 1) text += fmt::format("; {} further poses {}", poses, can);
  return text;
}

/// What the named effects leave.
std::string UnknownPart(const Diagnosis& diagnosis) {
  const bool certain = diagnosis.misfit && diagnosis.misfit->certain;
  if (certain && (diagnosis.drivers == std::vector<std::string>{"artefact"} ||
                  diagnosis.drivers == std::vector<std::string>{"camera"})) {
    return "something in the rejected rows with " + TextOf(diagnosis.misfit->condition) +
           ", which may have moved";
  }
  if (certain && diagnosis.drivers.size() == 1) {
    return std::string("an effect outside the catalogue, or larger noise, in the ") +
           (diagnosis.misfit->larger_residuals ? "rows with " : "rejected rows with ") +
           TextOf(diagnosis.misfit->condition);
  }
  if (!diagnosis.drivers.empty()) {
    return "an effect outside the catalogue that follows " + Listed(diagnosis.drivers);
  }
  if (diagnosis.declared_noise_too_small) {
    return "an effect outside the catalogue that follows no recorded signal, or noise" +
           NoiseClause(diagnosis);
  }
  return "an effect outside the catalogue that follows no recorded signal";
}

std::string UnknownHeadline(const Diagnosis& diagnosis) {
  std::string text = UnknownPart(diagnosis);
  std::vector<std::string> physical;
  for (const Finding& finding : diagnosis.findings) {
    const bool doubtful = std::ranges::any_of(diagnosis.doubts, [&](const Doubt& doubt) {
      return EffectName(doubt.id, doubt.scope) ==
             EffectName(finding.effect.term.effect->traits().id, ScopeOf(finding.effect.term));
    });
    if (!doubtful && !finding.effect.term.effect->traits().empirical)
      physical.push_back(EffectName(finding));
  }
  if (!physical.empty()) text += ", beside " + Listed(physical);
  if (!diagnosis.withheld.empty()) return text + "; no correction is written";
  return text + (HasEmpiricalTerm(diagnosis)
                     ? "; the unknown part is corrected empirically, within the measured range"
                     : "; the unknown part is not corrected");
}

}  // namespace

std::string Headline(const Diagnosis& diagnosis) {
  switch (diagnosis.verdict) {
    case Verdict::kNoEffect:
      return NoEffectHeadline(diagnosis) + NoiseClause(diagnosis);
    case Verdict::kExplained:
      return Listed(NamesOf(diagnosis, true)) + NoiseClause(diagnosis);
    case Verdict::kAmbiguous:
      return AmbiguousHeadline(diagnosis) + NoiseClause(diagnosis);
    case Verdict::kUnknown:
      break;
  }
  return UnknownHeadline(diagnosis);
}

std::string ErrorSentence(const Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return "";
  if (diagnosis.held_out_by.empty()) {
    return fmt::format("{} -> {} mm RMS on the fitted points; no points could be held out",
                       MillimetreText(diagnosis.rms_before_m),
                       MillimetreText(diagnosis.rms_after_m));
  }
  const HeldOutError& error = diagnosis.held_out;
  return fmt::format("{} -> {} mm RMS on held-out points (95 %: {} to {} mm)",
                     MillimetreText(error.before_m), MillimetreText(error.after_m),
                     MillimetreText(error.after_low_m), MillimetreText(error.after_high_m));
}

}  // namespace plumbline::measure
