#include "app/measure/siblings/siblings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/diagnosis/result/opinion.h"
#include "app/measure/siblings/prior_answer.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

/// Diagnoses the siblings; those that cannot be diagnosed are removed, with a note.
std::vector<Arm> Diagnosed(std::vector<Arm> arms, const Engine& engine,
                           const DiagnosisOptions& options, double share,
                           std::vector<std::string>& notes) {
  std::vector<Arm> diagnosed;
  for (std::size_t k = 0; k < arms.size(); ++k) {
    DiagnosisOptions own;
    own.threads = options.threads;
    own.next_poses = 0;
    own.order_unknown = options.order_unknown;
    own.interrupted = options.interrupted;
    own.progress = [&](double done, const std::string&) {
      if (!options.progress) return;
      options.progress(share * (static_cast<double>(k) + done) / static_cast<double>(arms.size()),
                       "diagnosing sibling " + arms[k].name);
    };
    Result<Diagnosis> found = engine(arms[k].cell, arms[k].rows, own);
    if (!found) {
      notes.push_back(fmt::format("sibling {} was left out: {}", arms[k].name, found.error()));
      continue;
    }
    arms[k].found = FindingsOf(*found);
    diagnosed.push_back(std::move(arms[k]));
  }
  return diagnosed;
}

/// Options of the arm's own diagnosis, whose progress goes from `from` to `to`.
DiagnosisOptions Within(const DiagnosisOptions& options, double from, double to) {
  DiagnosisOptions part = options;
  if (options.progress) {
    part.progress = [&options, from, to](double share, const std::string& what) {
      options.progress(from + (to - from) * share, what);
    };
  }
  return part;
}

model::CellModel With(model::CellModel cell, const std::vector<effects::ActiveEffect>& effects) {
  for (const effects::ActiveEffect& effect : effects) {
    cell.effects.push_back(effects::WrittenFromActive(effect, effect.covariance));
  }
  return cell;
}

/// Adds the siblings' effects to the findings. The siblings' rows separated their causes from
/// rivals, those of this arm did not, so that each is in doubt here.
void AddFindings(const Posterior& applied, const std::string& origin, Diagnosis& answer) {
  std::vector<Finding> findings;
  Opinion opinion;
  for (std::size_t k = 0; k < applied.effects.size(); ++k) {
    const effects::ActiveEffect& effect = applied.effects[k];
    Finding& finding = findings.emplace_back();
    finding.effect = effect;
    finding.covariance = effect.covariance;
    finding.tip_rms_m = applied.displacements[k].all_m;
    finding.tip_rms_of_each_m = applied.displacements[k].each_m;
    finding.origin = origin;
    const Eigen::Map<const Eigen::VectorXd> values(effect.values.data(),
                                                   static_cast<Eigen::Index>(effect.values.size()));
    finding.p_value = statistics::ChiSquareTail(values.dot(effect.covariance.ldlt().solve(values)),
                                                static_cast<double>(values.size()));
    const model::WrittenEffect written = effects::WrittenFromActive(effect, effect.covariance);
    opinion.doubts.push_back(
        {written.id, written.scope,
         effect.term.effect->traits().zero_mean_over_arms
             ? "each arm has its own: siblings show only how large it usually is"
             : "it was taken from siblings; these rows do not separate it from its rivals"});
  }
  answer.findings.insert(answer.findings.begin(), findings.begin(), findings.end());
  opinion.permits = Verdict::kAmbiguous;
  FoldOpinions({std::move(opinion)}, answer);
}

/// True if the siblings' mean alone, which no row of this arm took part in, explains most of the
/// rows' excess over their noise. Held-out errors near the noise can no longer show that.
bool PredictedByMean(const SiblingEvidence& evidence, double noise_m) {
  constexpr double kMost = 0.75;  // of the mean square: a judgement
  const double noise2 = noise_m * noise_m;
  const double declared2 = evidence.declared_m * evidence.declared_m - noise2;
  const double left2 = evidence.predicted_m * evidence.predicted_m - noise2;
  return declared2 > 0 && left2 < (1 - kMost) * declared2;
}

bool IsZero(const effects::ActiveEffect& effect) {
  return std::ranges::all_of(effect.values, [](double value) { return value == 0; });
}

/// The agreed sizes fitted to the rows of every arm, and pooled.
Result<FleetPrior> PriorFrom(const std::vector<Arm>& arms, int threads,
                             std::vector<std::string>& notes) {
  if (arms.size() < 2) return Error{"at least two siblings that can be diagnosed are needed"};
  std::vector<const ArmFindings*> found;
  for (const Arm& arm : arms) found.push_back(&arm.found);
  const Result<AgreedSizes> agreed = AgreeOnSizes(found, arms.front().cell);
  if (!agreed) return agreed.failure();
  const std::vector<double> start(agreed->keys.size(), 0.0);
  std::vector<ArmFit> fits;
  for (const Arm& arm : arms) {
    const Result<SizeFit> fit = FitSizes(arm, agreed->keys, start, OwnFindings::kFitted, threads);
    if (fit) {
      fits.push_back({arm.name, *fit});
    } else {
      notes.push_back(fmt::format("sibling {} does not take part: {}", arm.name, fit.error()));
    }
  }
  Result<FleetPrior> prior = PoolFits(*agreed, std::move(fits));
  if (!prior) return prior;
  for (const LeftOutArm& one : prior->left_out) {
    notes.push_back(fmt::format("sibling {} was left out: {}", one.arm, one.reason));
  }
  return prior;
}

}  // namespace

Result<Diagnosis> DiagnoseWithPrior(const model::CellModel& cell, const MeasuredTable& rows,
                                    const Result<FleetPrior>& prior, const Engine& engine,
                                    const DiagnosisOptions& options) {
  SiblingEvidence evidence;
  if (prior) {
    evidence.source = prior->Source();
    evidence.model = prior->model;
    evidence.date = prior->date;
    evidence.arms = prior->ArmNames();
    for (const LeftOutArm& one : prior->left_out) evidence.left_out.push_back(one.arm);
  }
  Result<Diagnosis> without = engine(cell, rows, Within(options, 0, prior ? 0.5 : 1));
  if (!without) return Error{without.error()};
  Diagnosis answer = *without;
  const auto finish = [&] {
    answer.notes.insert(answer.notes.begin(),
                        fmt::format("{}: {}", prior ? evidence.source : "other arms of this model",
                                    evidence.reason));
    answer.siblings = evidence;
    return answer;
  };
  const auto not_used = [&](const std::string& reason) {
    evidence.reason = "not used: " + reason;
    return finish();
  };
  if (!prior) return not_used(prior.error());
  constexpr double kAtNoise = 1.1;
  if (without->verdict == Verdict::kNoEffect &&
      without->rms_before_m <= kAtNoise * without->noise_floor_m) {
    return not_used("the declared cell predicts these rows within their noise already");
  }
  Arm arm{"", cell, rows, FindingsOf(*without)};
  if (options.order_unknown) arm.rows.recorded.order = false;
  const std::vector<effects::ActiveEffect> mean = MeanEffectsOf(prior->sizes, cell);
  for (const effects::ActiveEffect& effect : mean) {
    if (IsZero(effect)) continue;  // each arm has its own
    Finding& common = evidence.common.emplace_back();
    common.effect = effect;
    common.covariance = effect.covariance;
  }
  const Result<double> declared = AlignedRms(cell, arm, options.threads);
  const Result<double> predicted = AlignedRms(With(cell, mean), arm, options.threads);
  const Result<Posterior> posterior = UpdatedBy(arm, prior->sizes, options.threads);
  if (!declared) return not_used(declared.error());
  if (!predicted) return not_used(predicted.error());
  if (!posterior) return not_used(posterior.error());
  evidence.declared_m = *declared;
  evidence.predicted_m = *predicted;
  if (posterior->p_value < kDifferentArm) {
    return not_used(fmt::format(
        "this arm differs from its siblings (p {}); what they have in common predicts its "
        "rows to {:.3f} mm, the declared cell to {:.3f} mm",
        ProbabilityText(posterior->p_value), kMmPerMetre * evidence.predicted_m,
        kMmPerMetre * evidence.declared_m));
  }
  const model::CellModel extended = With(cell, posterior->effects);
  Result<Diagnosis> with = engine(extended, rows, Within(options, 0.5, 1));
  if (!with) return not_used("with them the rows cannot be diagnosed: " + with.error());
  if (!with->withheld.empty() && !WithheldByHeldOutRows(*with))
    return not_used("with them " + with->withheld);
  RemoveUnconfirmed(with.value());
  const std::optional<double> factor = FactorForNewRows(posterior->parameters, *with);
  const std::optional<double> held_out_without = HeldOutOf(*without);
  if (!factor || !held_out_without || !HeldOutOf(*with)) {
    return not_used("too few rows to hold any out, so that nothing can confirm them");
  }
  Widen(*factor, with.value());
  evidence.held_out_without_m = *held_out_without;
  evidence.held_out_with_m = *HeldOutOf(*with);
  const std::string errors = fmt::format(
      "the held-out error is {:.3f} mm with them and {:.3f} mm without",
      kMmPerMetre * evidence.held_out_with_m, kMmPerMetre * evidence.held_out_without_m);
  const std::optional<double> gain = GainInStandardErrors(*with, *without, *factor);
  if (!gain)
    return not_used("fewer than three rows can be held out, so that nothing confirms them");
  // With siblings the verdict is at best ambiguous, so an arm that its own rows explain uses them
  // only for a clear gain.
  const bool predicted_well =
      without->verdict != Verdict::kExplained && PredictedByMean(evidence, without->noise_floor_m);
  if (*gain < -1) return not_used(errors + ", clearly worse");
  if (*gain <= 1 && !predicted_well) return not_used(errors + ", no clear gain");
  evidence.used = true;
  answer = std::move(with).value();
  StateErrorsBefore(*without, answer);
  AddFindings(*posterior, evidence.source, answer);
  std::vector<std::string> ids;
  for (const Finding& finding : evidence.common)
    ids.emplace_back(finding.effect.term.effect->traits().id);
  evidence.applied = posterior->effects;
  evidence.reason = fmt::format(
      "the first effects are what they have in common ({}), adjusted to these rows. The declared "
      "cell predicts the rows to {:.3f} mm, the siblings' mean alone to {:.3f} mm; {}",
      fmt::join(ids, ", "), kMmPerMetre * evidence.declared_m, kMmPerMetre * evidence.predicted_m,
      errors);
  return finish();
}

Result<Diagnosis> DiagnoseWithSiblings(const model::CellModel& cell, const MeasuredTable& rows,
                                       std::vector<Arm> siblings, const Engine& engine,
                                       const DiagnosisOptions& options) {
  std::vector<std::string> notes;
  const double all = static_cast<double>(siblings.size());
  const double share = all / (all + 2);
  const std::vector<Arm> arms = Diagnosed(std::move(siblings), engine, options, share, notes);
  const Result<FleetPrior> prior = PriorFrom(arms, options.threads, notes);
  Result<Diagnosis> answer =
      DiagnoseWithPrior(cell, rows, prior, engine, Within(options, share, 1));
  if (!answer) return answer;
  answer.value().notes.insert(answer->notes.begin() + 1, notes.begin(), notes.end());
  return answer;
}

}  // namespace plumbline::measure
