#include "app/measure/diagnosis/output/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "firmware-like/geometry/units.h"

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
  for (std::size_t k = 0; k < names.size(); ++k) {  // such as drifts with two time constants
    const auto count = std::ranges::count(names, names[k]);
    if (count < 2) continue;
    const std::string name = names[k];
    names[k] += count == 2 ? " (twice)" : fmt::format(" ({} times)", count);
    std::erase(names, name);
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

/// The drivers; those that may take the place of others apart.
std::string DriversText(const Diagnosis& diagnosis) {
  std::vector<std::string> own, alternatives;
  for (const std::string& driver : diagnosis.drivers) {
    const bool alternative =
        std::ranges::any_of(diagnosis.rival_drivers, [&](const std::vector<std::string>& columns) {
          return std::ranges::find(columns, driver) != columns.end();
        });
    (alternative ? alternatives : own).push_back(driver);
  }
  if (own.empty() || alternatives.empty()) return Listed(diagnosis.drivers);
  return Listed(own) + ", or else " + Listed(alternatives, "or");
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
    return "an effect outside the catalogue that follows " + DriversText(diagnosis);
  }
  if (diagnosis.declared_noise_too_small) {
    return "an effect outside the catalogue that follows no single recorded signal, or noise" +
           NoiseClause(diagnosis);
  }
  return "an effect outside the catalogue that follows no single recorded signal";
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

namespace {

constexpr std::size_t kMaxEffects = 5;  // lines of each list without details
constexpr std::size_t kMaxPoses = 3;
constexpr std::size_t kMaxLines = 8;  // numbers of outlier lines

/// "  and 3 more\n" if a list is longer than shown.
std::string More(std::size_t count, std::size_t shown) {
  return count > shown ? fmt::format("  and {} more\n", count - shown) : "";
}

bool IsDoubtful(const Diagnosis& diagnosis, const Finding& finding) {
  return std::ranges::any_of(diagnosis.doubts, [&](const Doubt& doubt) {
    return doubt.id == finding.effect.term.effect->traits().id &&
           doubt.scope == ScopeOf(finding.effect.term);
  });
}

/// One line for each effect: its name, its size at the tip, and whether it is in doubt.
void AddEffects(const Diagnosis& diagnosis, std::string& text) {
  const auto& findings = diagnosis.findings;
  if (findings.empty()) return;
  text += fmt::format("  {:<40}  RMS at the tip\n", "effect");
  for (std::size_t k = 0; k < std::min(findings.size(), kMaxEffects); ++k) {
    text += fmt::format("  {:<40}  {} mm{}\n", EffectName(findings[k]),
                        MillimetreText(findings[k].tip_rms_m),
                        IsDoubtful(diagnosis, findings[k]) ? ", in doubt" : "");
  }
  text += More(findings.size(), kMaxEffects);
}

void AddParameters(const Diagnosis& diagnosis, std::string& text) {
  for (const Finding& finding : diagnosis.findings) {
    for (const EmpiricalCurve& curve : EmpiricalCurvesOf(finding.effect)) {
      text += fmt::format("  {:<21} {}: {} {} along {}\n", EffectName(finding), curve.meaning,
                          curve.range, curve.unit, Listed(finding.effect.term.drivers));
    }
    if (finding.effect.term.effect->traits().empirical) {
      const std::string line = LinearTrendText(finding.effect);
      if (!line.empty()) text += "    " + line + '\n';
      continue;
    }
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (const model::EffectParameter& parameter : written.parameters) {
      const ValueText shown = ShownValueOf(parameter);
      text += fmt::format("  {:<21} {:<14}{:>12}{:<12} {}\n", EffectName(written.id),
                          parameter.name, shown.value, shown.sd.empty() ? "" : " +- " + shown.sd,
                          ShownUnitOf(parameter).unit);
    }
    if (!finding.implausible.empty()) text += "    implausible: " + finding.implausible + '\n';
  }
}

void AddRivals(const Diagnosis& diagnosis, std::string& text) {
  for (const Rival& rival : diagnosis.rivals) {
    text +=
        fmt::format("Rival: {} instead of {}; it reproduces {} of the signal\n", RivalName(rival),
                    ReplacedName(rival), PercentText(std::max(0.0, 1 - rival.signal_left)));
  }
}

/// Why an effect is doubtful, and what the answer leaves unexplained: the first reason, or all.
void AddDoubts(const Diagnosis& diagnosis, bool all, std::string& text) {
  std::vector<std::string> lines;
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) lines.push_back("Not explained: " + check.sentence);
  }
  for (const Doubt& doubt : diagnosis.doubts) {
    lines.push_back(
        fmt::format("Doubtful: {}: {}", EffectName(doubt.id, doubt.scope), doubt.reason));
  }
  if (lines.size() > 1 && !all) {
    lines.front() += fmt::format(" (and {} more)", lines.size() - 1);
    lines.resize(1);
  }
  for (const std::string& line : lines) text += line + '\n';
}

void AddNextPoses(const Diagnosis& diagnosis, const model::CellModel& cell, bool all,
                  std::string& text) {
  const auto& poses = diagnosis.next_poses;
  if (poses.empty()) return;
  const auto slides = [&](const model::Joint& joint) {
    return joint.type == model::JointType::kPrismatic;
  };
  const bool some_slide = std::ranges::any_of(cell.robot.joints, slides);
  text += fmt::format(
      "Measure next (joints in degrees{}; apart: distance between the tips that the explanations "
      "predict)\n",
      some_slide ? ", linear joints in mm" : "");
  const std::size_t shown = all ? poses.size() : std::min(poses.size(), kMaxPoses);
  for (std::size_t k = 0; k < shown; ++k) {
    text += fmt::format("  {}:", k + 1);
    for (Eigen::Index i = 0; i < poses[k].q.size(); ++i) {
      const bool linear = slides(cell.robot.joints[i]);
      text += fmt::format(" {:7.1f}", poses[k].q[i] * (linear ? kMmPerMetre : kDegPerRad));
    }
    const std::string how = MeasuringText(poses[k]);
    text += fmt::format("  {:5.1f} kg  {} mm apart{}{}\n", poses[k].payload_kg,
                        MillimetreText(poses[k].separation_m), how.empty() ? "" : "; ", how);
  }
  text += More(poses.size(), shown);
}

std::string DataLine(const Diagnosis& diagnosis) {
  const std::string floor_mm = MillimetreText(diagnosis.noise_floor_m),
                    sigma_mm = MillimetreText(diagnosis.sigma_m),
                    origin = OriginText(diagnosis.sigma_origin);
  std::string text = fmt::format("{} rows, ", diagnosis.rows.size());
  if (diagnosis.noise_floor_origin == diagnosis.sigma_origin) {
    text += fmt::format("noise floor {} mm (sigma {} mm, {})", floor_mm, sigma_mm, origin);
  } else {
    text += fmt::format("noise floor {} mm ({}), sigma in use {} mm ({})", floor_mm,
                        OriginText(diagnosis.noise_floor_origin), sigma_mm, origin);
  }
  if (!diagnosis.held_out_by.empty()) text += "; held out: " + diagnosis.held_out_by;
  const auto& outliers = diagnosis.outlier_rows;
  if (outliers.empty()) return text + "; no outliers\n";
  text += fmt::format("; {} outlier{} in line{}", outliers.size(), outliers.size() == 1 ? "" : "s",
                      outliers.size() == 1 ? "" : "s");
  for (std::size_t k = 0; k < std::min(outliers.size(), kMaxLines); ++k) {
    text += fmt::format("{} {}", k == 0 ? "" : ",", outliers[k]);
  }
  return text + (outliers.size() > kMaxLines ? ", ..\n" : "\n");
}

/// "Other arms: 37 arms of KR 210 R2700-2, 2026-11-30; used".
std::string SiblingsLine(const SiblingEvidence& siblings) {
  return fmt::format("Other arms: {}{}{}\n", siblings.source, siblings.source.empty() ? "" : "; ",
                     siblings.used ? "used" : siblings.reason);
}

}  // namespace

std::string SummaryText(const Diagnosis& diagnosis, const SummaryContext& context) {
  std::string word = Describe(diagnosis.verdict);
  for (char& letter : word) letter = letter == '_' ? ' ' : static_cast<char>(letter - 'a' + 'A');
  std::string text = fmt::format("{}: {}\n", word, Headline(diagnosis));
  if (const std::string error = ErrorSentence(diagnosis); !error.empty()) {
    text += error;
    if (context.tolerance_m) {
      text += fmt::format("; tolerance {} mm", MillimetreText(*context.tolerance_m));
    }
    text += '\n';
  }
  if (!context.next_step.empty()) text += "Next: " + context.next_step + '\n';
  if (diagnosis.siblings) text += SiblingsLine(*diagnosis.siblings);
  AddEffects(diagnosis, text);
  AddDoubts(diagnosis, context.details, text);
  AddNextPoses(diagnosis, context.cell, context.details, text);
  text += DataLine(diagnosis);
  if (!context.details) return text + "--details shows values, rivals and notes\n";
  AddParameters(diagnosis, text);
  AddRivals(diagnosis, text);
  for (const std::string& remark : diagnosis.not_recorded) text += "Not recorded: " + remark + '\n';
  for (const std::string& note : diagnosis.notes) text += "Note: " + note + '\n';
  return text;
}

}  // namespace plumbline::measure
