#include "app/measure/diagnosis/critics/explanation_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/findings.h"
#include "firmware-like/effects/parameter_name.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
bool SelectedWhole(const std::vector<SelectedEffect>& fold, const Finding& finding) {
  const auto selected = std::ranges::find_if(
      fold, [key = KeyOfFinding(finding)](const SelectedEffect& one) { return one.key == key; });
  if (selected == fold.end()) return false;
  const auto& parameters = finding.effect.term.parameters;
  return std::ranges::all_of(parameters, [&](const effects::TermParameter& parameter) {
    return parameter.joint < 0 || selected->joints.contains(parameter.joint);
  });
}

namespace {

constexpr double kLargestReported = 1000;  // stands for infinity, which JSON cannot represent
constexpr double kTrainingShare = 0.8;     // of the rows, with five folds

ExplanationCheck PValueCheck(const Finding& finding) {
  ExplanationCheck check;
  check.name = "p_value";
  check.figure = finding.p_value;
  check.limit = kMaxPValue;
  check.passed = finding.p_value <= kMaxPValue;
  check.sentence = fmt::format(
      "p-value {} under noise alone, corrected for the number of alternatives searched; at most {} "
      "is accepted",
      finding.p_value > 0 ? fmt::format("{:.2g}", finding.p_value) : "below 1e-300", kMaxPValue);
  return check;
}

ExplanationCheck FrequencyCheck(double frequency, std::size_t folds) {
  ExplanationCheck check;
  check.name = "selection_frequency";
  check.figure = frequency;
  check.limit = kMinSelectionFrequency;
  check.passed = frequency >= kMinSelectionFrequency - 1e-9;
  check.sentence =
      fmt::format("selected in {:.0f} of {} cross-validation folds; at least {:.0f} % are required",
                  frequency * static_cast<double>(folds), folds, 100 * kMinSelectionFrequency);
  return check;
}

ExplanationCheck PlausibilityCheck(const Finding& finding) {
  ExplanationCheck check;
  check.name = "plausible";
  check.passed = finding.implausible_times < kDoubtfulRatio;
  check.figure = std::min(finding.implausible_times, kLargestReported);
  check.limit = kDoubtfulRatio;
  check.sentence = finding.implausible.empty() ? "every value is plausible for a healthy machine"
                                               : finding.implausible;
  return check;
}

/// True for a shape that is a positive magnitude, such as a time constant: unlike a phase, it can
/// be compared with its standard deviation.
bool IsMagnitude(const effects::ParameterSpec& spec) {
  return spec.role == effects::ParameterRole::kShape && spec.plausible.low > 0;
}

/// Names of the values whose standard deviation exceeds them, if a time constant or another
/// positive shape is among them, or all sizes are; otherwise empty, since one small component of a
/// larger size (the z of a displacement along x) is determined.
std::vector<std::string> UndeterminedValues(const Finding& finding) {
  const effects::EffectTerm& term = finding.effect.term;
  const effects::EffectTraits& traits = term.effect->traits();
  std::vector<std::string> names;
  bool magnitude = false, determined_size = false;
  for (std::size_t k = 0; k < finding.effect.values.size(); ++k) {
    const auto& spec = traits.parameters[term.parameters[k].spec];
    const bool size = spec.role == effects::ParameterRole::kSize;
    if (!size && !IsMagnitude(spec)) continue;
    const auto place = static_cast<Eigen::Index>(k);
    const double value = finding.effect.values[k];
    const bool open = finding.covariance(place, place) > value * value;
    determined_size = determined_size || (size && !open);
    if (!open) continue;
    magnitude = magnitude || !size;
    names.push_back(effects::NameFromParameter(traits, term.parameters[k]));
  }
  return magnitude || !determined_size ? names : std::vector<std::string>();
}

ExplanationCheck DeterminedCheck(const Finding& finding) {
  ExplanationCheck check;
  check.name = "determined";
  const bool known = finding.covariance.size() > 0;
  const std::vector<std::string> open =
      known ? UndeterminedValues(finding) : std::vector<std::string>();
  check.passed = known && open.empty();
  check.figure = check.passed ? 1 : 0;
  check.limit = 1;
  check.sentence = "the rows determine every value";
  if (!known) {
    check.sentence =
        "the rows do not determine all of its values, so no standard deviation can be stated";
  } else if (open.size() == 1) {
    check.sentence = fmt::format(
        "the rows do not determine {}: its standard deviation exceeds its value", open.front());
  } else if (!open.empty()) {
    check.sentence = fmt::format(
        "the rows do not determine {} separately: the standard deviation of each exceeds its value",
        Listed(open));
  }
  return check;
}

/// Largest number of spectral lines on one joint, and that joint; nullopt for other effects.
std::optional<std::pair<int, int>> MostLines(const effects::EffectTerm& term) {
  std::map<int, int> lines;
  for (const effects::TermParameter& parameter : term.parameters) {
    const auto& specs = term.effect->traits().parameters;
    if (effects::IsCycles(specs[parameter.spec])) ++lines[parameter.joint];
  }
  const auto most = std::ranges::max_element(
      lines, [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == lines.end()) return std::nullopt;
  return std::pair(most->second, most->first);
}

std::optional<ExplanationCheck> LinesCheck(const Finding& finding) {
  const auto most = MostLines(finding.effect.term);
  if (!most) return std::nullopt;
  ExplanationCheck check;
  check.name = "lines_of_one_joint";
  check.figure = most->first;
  check.limit = kMaxLinesPerJoint;
  check.passed = most->first <= kMaxLinesPerJoint;
  check.sentence = check.passed
                       ? "no joint has more than one spectral line"
                       : fmt::format(
                             "{} spectral lines on axis {} fit almost any function of its angle, "
                             "whether the gear or another cause produces it",
                             most->first, most->second + 1);
  return check;
}

ExplanationCheck HeldOutCheck(const ExplanationEvidence& evidence, const HeldOutRatio& found) {
  const double noise_mm =
      1e3 * evidence.problem.sigma_m * std::sqrt(evidence.problem.data.noise_per_row());
  ExplanationCheck check;
  check.name = "held_out_error";
  check.figure = noise_mm * std::sqrt(found.ratio);
  check.limit = noise_mm * std::sqrt(found.limit);
  check.passed = found.ratio <= found.limit;
  check.sentence = fmt::format(
      "held-out error {:.3g} mm{} in the folds that selected these effects; the noise in use, "
      "{:.3g} "
      "mm, accounts for at most {:.3g} mm (chi-square limit, {} clusters, 0.1 %)",
      check.figure,
      evidence.problem.data.table.recorded.sigma ? ", scaled by each row's own noise," : "",
      noise_mm, check.limit, found.clusters);
  return check;
}

ExplanationCheck DiscrepancyCheck(const ExplanationEvidence& evidence) {
  const Dataset& data = evidence.problem.data;
  const double sigma_m = data.sigma_m > 0 ? data.sigma_m : evidence.problem.sigma_m;
  ExplanationCheck check;
  check.name = "discrepancy_model";
  check.figure = 1e3 * evidence.discrepancy_rms_m;
  check.limit = 1e3 * sigma_m * std::sqrt(data.noise_per_row());
  check.passed = check.figure <= check.limit;
  check.sentence = fmt::format(
      "the discrepancy model corrects {:.3g} mm beyond the named effects, without a physical "
      "cause; at most the noise, {:.3g} mm, is accepted",
      check.figure, check.limit);
  return check;
}

/// The noise of one axis: declared, or the scatter of repeated points if that is larger [m].
struct KnownNoise {
  double sigma_m = 0;
  bool repeats = false, of_repeats = false;

  explicit KnownNoise(const Dataset& data) : repeats(data.repeat_sigma_m > 0) {
    const double repeats_m = repeats ? std::hypot(data.repeat_sigma_m, data.reading_sigma_m) : 0;
    of_repeats = repeats_m >= data.sigma_m;
    sigma_m = std::max(data.sigma_m, repeats_m);
  }
};

/// Degrees of freedom of the residual; correlated rows count as fewer.
double FreedomOf(const ExplanationEvidence& evidence) {
  const FitProblem& problem = evidence.problem;
  double freedom = -evidence.parameters;
  for (const RowIndex row : problem.data.row_indices()) {
    if (problem.weights[row] >= kOutlierWeight) freedom += problem.data.numbers[row].count;
  }
  return freedom * (1 - problem.row_correlation) / (1 + problem.row_correlation);
}

/// Whether noise accounts for the residual: by chi-square, or by F if the noise was estimated from
/// repeats, and apart from an excess that lack_of_fit accepts, too. nullopt if the noise is
/// unknown.
std::optional<ExplanationCheck> NoiseCheck(const ExplanationEvidence& evidence) {
  const Dataset& data = evidence.problem.data;
  const KnownNoise noise(data);
  const double freedom = FreedomOf(evidence);
  if (data.sigma_m <= 0 || freedom < 1) return std::nullopt;
  const double ratio =
      noise.of_repeats
          ? FisherQuantile(kResidualSignificance, freedom, std::max(1, data.repeat_freedom))
          : statistics::ChiSquareQuantile(kResidualSignificance, freedom) / freedom;
  const double largest = std::sqrt(std::max(ratio, 1 + kNotableLackOfFit * kNotableLackOfFit));
  ExplanationCheck check;
  check.name = "residual_noise";
  check.figure = 1e3 * evidence.residual_sigma_m;
  check.limit = 1e3 * largest * noise.sigma_m;
  check.passed = check.figure <= check.limit;
  check.sentence = fmt::format(
      "the residual is {:.3g} mm per axis; a noise of {:.3g} mm{} accounts for at most {:.3g} mm "
      "(0.1 %){}",
      check.figure, 1e3 * noise.sigma_m, noise.of_repeats ? " (scatter of repeated points)" : "",
      check.limit, noise.repeats ? "" : ", unless repeated points show a larger noise");
  return check;
}

/// Adds the checks of a finding and returns the sentences of the failed ones.
std::vector<std::string> CheckFinding(const ExplanationEvidence& evidence, const Finding& finding,
                                      std::vector<ExplanationCheck>& checks) {
  std::vector<ExplanationCheck> of_finding = {PValueCheck(finding), PlausibilityCheck(finding),
                                              DeterminedCheck(finding)};
  const auto frequency = SelectionFrequency(evidence.held_out, finding);
  if (frequency) {
    of_finding.push_back(FrequencyCheck(*frequency, evidence.held_out.selected.size()));
  }
  if (auto lines = LinesCheck(finding)) of_finding.push_back(std::move(*lines));
  std::vector<std::string> failed;
  for (ExplanationCheck& check : of_finding) {
    check.effect = KeyOfFinding(finding).id;
    if (!check.passed) failed.push_back(check.sentence);
    checks.push_back(std::move(check));
  }
  return failed;
}

/// The folds whose search selected all named effects with all their joints. Other folds validate a
/// different explanation (an offset instead of backlash whose few rows on the other flank are held
/// out); `selection_frequency` counts those. All folds if none agrees, or if some were not
/// searched.
std::vector<bool> FoldsThatAgree(const HeldOut& held_out, const std::vector<Finding>& findings) {
  const auto last = std::ranges::max_element(held_out.fold_of);
  const std::size_t folds =
      last == held_out.fold_of.end() ? 0 : static_cast<std::size_t>(*last) + 1;
  std::vector<bool> agree(folds, true);
  if (held_out.selected.size() != folds) return agree;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    agree[fold] = std::ranges::all_of(findings, [&](const Finding& finding) {
      if (!finding.effect.term.drivers.empty()) return true;  // an empirical curve names no cause
      return SelectedWhole(held_out.selected[fold], finding);
    });
  }
  if (std::ranges::none_of(agree, [](bool one) { return one; })) {
    agree.assign(folds, true);
  }
  return agree;
}

/// Whether points held out are predicted better with the effects than without; nullopt if none
/// were.
std::optional<ExplanationCheck> HeldOutGainCheck(const Diagnosis& diagnosis) {
  if (diagnosis.held_out_by.empty()) return std::nullopt;
  ExplanationCheck check;
  check.name = "held_out_gain";
  check.figure = 1e3 * diagnosis.held_out.after_m;
  check.limit = 1e3 * diagnosis.held_out.before_m;
  check.passed = check.figure < check.limit;
  check.sentence = fmt::format(
      "held-out points have an error of {:.3g} mm with the effects, and of {:.3g} mm without",
      check.figure, check.limit);
  return check;
}

bool HasOrientations(const Dataset& data) {
  const auto& turned = data.turned_sessions;
  return std::ranges::find(turned, true) != turned.end();
}

/// True if held-out points do not support a finding. Orientations may support one that moves no
/// point; with them, only an implausible value whose correction is withheld is unsupported.
bool IsUnsupported(const Finding& finding, const Dataset& data, const Diagnosis& diagnosis) {
  return !HasOrientations(data) || (!finding.implausible.empty() && !diagnosis.withheld.empty());
}

}  // namespace

HeldOutRatio HeldOutOverNoise(const ExplanationEvidence& evidence,
                              const std::vector<Finding>& findings) {
  const std::vector<bool> agree = FoldsThatAgree(evidence.held_out, findings);
  struct Sum {
    double square = 0, weight = 0;
  };
  const FitProblem& problem = evidence.problem;
  std::map<ClusterIndex, Sum> clusters;
  Sum total;
  double predicted = 0;  // over all folds: each is trained on the rows of the others
  for (const RowIndex row : problem.data.row_indices()) {
    const double weight = problem.weights[row];
    if (!evidence.held_out.predicted[row] || weight < kOutlierWeight) continue;
    predicted += weight;
    if (!agree.empty() && !agree[static_cast<std::size_t>(evidence.held_out.fold_of[row])])
      continue;
    Sum& cluster = clusters[problem.data.cluster_of[row]];
    const RowNumbers& numbers = problem.data.numbers[row];
    const double variance = problem.sigma_m * problem.sigma_m * numbers.LengthVariance();
    const double lengths = weight * numbers.lengths();
    for (Sum* sum : {&cluster, &total}) {
      sum->square += lengths * evidence.held_out.after[row].squaredNorm() / variance;
      sum->weight += lengths;
    }
  }
  HeldOutRatio found;
  found.clusters = static_cast<int>(clusters.size());
  if (total.weight == 0) return found;
  const double lengths = problem.data.lengths_per_row();
  found.ratio = total.square / total.weight;
  const double freedom = lengths * static_cast<double>(clusters.size());
  const double of_training = kTrainingShare * lengths * predicted;
  found.limit = statistics::ChiSquareQuantile(kHeldOutSignificance, freedom) / freedom *
                (1 + evidence.parameters / std::max(1.0, of_training));
  return found;
}

std::optional<double> SelectionFrequency(const HeldOut& held_out, const Finding& finding) {
  const auto& folds = held_out.selected;
  if (folds.empty()) return std::nullopt;
  const auto count =
      std::ranges::count_if(folds, [&](const auto& fold) { return SelectedWhole(fold, finding); });
  return static_cast<double>(count) / static_cast<double>(folds.size());
}

namespace {

/// Whether noise accounts for the residual. What a data sheet states may be exceeded, but not far.
Opinion OpinionOnNoise(const ExplanationEvidence& evidence, const Diagnosis& diagnosis) {
  Opinion opinion;
  const auto noise = NoiseCheck(evidence);
  if (!noise) return opinion;
  opinion.checks.push_back(*noise);
  if (noise->passed) return opinion;
  const KnownNoise known(evidence.problem.data);
  opinion.noise_too_small = !known.repeats;
  // Without a name, what exceeds the noise has no cause that the answer could leave open.
  opinion.permits = diagnosis.findings.empty() ? Verdict::kUnknown : Verdict::kAmbiguous;
  if (evidence.residual_sigma_m > kUnexplainedNoiseRatio * known.sigma_m)
    opinion.permits = Verdict::kUnknown;
  return opinion;
}

/// The checks of each finding; one that fails any of them is doubtful.
Opinion OpinionOnFindings(const ExplanationEvidence& evidence, const Diagnosis& diagnosis) {
  Opinion opinion;
  if (diagnosis.findings.empty()) return opinion;
  const std::optional<ExplanationCheck> gain = HeldOutGainCheck(diagnosis);
  if (gain) opinion.checks.push_back(*gain);
  const Dataset& data = evidence.problem.data;
  for (const Finding& finding : diagnosis.findings) {
    if (!finding.effect.term.drivers.empty()) continue;  // an empirical curve names no cause
    std::vector<std::string> failed = CheckFinding(evidence, finding, opinion.checks);
    if (failed.empty() && gain && !gain->passed && IsUnsupported(finding, data, diagnosis)) {
      failed.push_back((finding.implausible.empty() ? "" : finding.implausible + ", and ") +
                       "held-out points are predicted no better than by the declared model");
    }
    if (failed.empty()) continue;
    opinion.doubts.push_back(
        {KeyOfFinding(finding).id, ScopeOf(finding.effect.term), Listed(failed)});
  }
  return opinion;
}

/// An answer that fails the check leaves a part of the residual unexplained.
Opinion OpinionOfCheck(ExplanationCheck check) {
  Opinion opinion;
  if (!check.passed) opinion.permits = Verdict::kUnknown;
  opinion.checks.push_back(std::move(check));
  return opinion;
}

Opinion OpinionOnHeldOutError(const ExplanationEvidence& evidence, const Diagnosis& diagnosis) {
  if (diagnosis.findings.empty()) return {};
  const HeldOutRatio found = HeldOutOverNoise(evidence, diagnosis.findings);
  return found.clusters > 0 ? OpinionOfCheck(HeldOutCheck(evidence, found)) : Opinion();
}

Opinion OpinionOnDiscrepancy(const ExplanationEvidence& evidence, const Diagnosis& diagnosis) {
  return diagnosis.findings.empty() ? Opinion() : OpinionOfCheck(DiscrepancyCheck(evidence));
}

}  // namespace

void CheckExplanation(const ExplanationEvidence& evidence, Diagnosis& diagnosis) {
  std::vector<Opinion> opinions;
  for (const auto critic :
       {OpinionOnNoise, OpinionOnFindings, OpinionOnHeldOutError, OpinionOnDiscrepancy}) {
    opinions.push_back(critic(evidence, diagnosis));
  }
  FoldOpinions(std::move(opinions), diagnosis);
}

}  // namespace plumbline::measure
