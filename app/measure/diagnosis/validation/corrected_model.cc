#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/discrepancy.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"
#include "app/measure/diagnosis/validation/held_out.h"

namespace plumbline::measure {
namespace {

/// sqrt(more^2 - less^2), or 0 if `more_m` is smaller.
double RmsBeyond(double more_m, double less_m) {
  return std::sqrt(std::max(0.0, more_m * more_m - less_m * less_m));
}

/// Adds the held-out errors of all schemes, and separately those of blocks of time.
void AddHeldOutErrors(const Validation& validation, Diagnosis& diagnosis) {
  diagnosis.held_out_by_all = validation.errors;
  for (const HeldOutError& error : validation.errors) {
    if (error.by != validation.schemes.front().by) continue;
    diagnosis.held_out = error;
    diagnosis.held_out_by = error.by;
  }
}

/// The model of the written findings plus the effects of the discrepancy model, with its free
/// frames refitted.
Result<FittedModel> WithDiscrepancy(const Task& task, const FitOfAllRows& fit,
                                    const DiscrepancyModel& discrepancy, Diagnosis& diagnosis) {
  const Dataset& data = task.data;
  Model model = fit.refit.model;
  model.effects.clear();
  for (const Finding& finding : diagnosis.findings) model.effects.push_back(finding.effect);
  diagnosis.discrepancy = EffectsToAdd(discrepancy, data, model);
  for (const Finding& finding : diagnosis.discrepancy) model.effects.push_back(finding.effect);
  if (data.frames_free() || data.tip_free()) {
    RefitOptions frames;
    frames.frames_only = true;
    const Result<Refit> refit = RefitModel(fit.problem, model, frames);
    if (!refit) return Error{refit.error()};
    model = refit->model;
  }
  const Result<Linearisation> linear = Linearise(data, model, false, task.options.threads);
  if (!linear) return Error{linear.error()};
  diagnosis.notes.push_back(fmt::format(
      "besides the named effects, the model contains a discrepancy model with {:.0f} effective "
      "parameters; it corrects within the measured range and explains nothing",
      discrepancy.effective_parameters));
  return FittedModel{model, ErrorsOf(*linear)};
}

/// The fitted model with its effects as written: curves are shrunk and limited to the range of
/// their rows.
Result<FittedModel> AsWritten(const Task& task, const FitOfAllRows& fit,
                              const Diagnosis& diagnosis) {
  FittedModel written{fit.refit.model, fit.errors};
  if (!HasEmpiricalTerm(diagnosis)) return written;
  written.model.effects.clear();
  for (const Finding& finding : diagnosis.findings) written.model.effects.push_back(finding.effect);
  const Result<Linearisation> linear =
      Linearise(task.data, written.model, false, task.options.threads);
  if (!linear) return Error{linear.error()};
  written.errors = ErrorsOf(*linear);
  return written;
}

}  // namespace

Result<CorrectedModel> Validated(const Task& task, const Identified& found, const FitOfAllRows& fit,
                                 Diagnosis& diagnosis) {
  task.Report(0.47, "fitting a discrepancy model");
  const std::optional<DiscrepancyModel> offered =
      DiscrepancyModelOf(*found.candidate_set, found.best, found.candidates);
  if (task.Interrupted()) return Task::InterruptedError();
  // Every fold repeats the search, so they take as long as everything before.
  const auto predicting = [&task](double share) {
    task.Report(0.5 + 0.5 * share, "predicting held-out rows");
  };
  const InputsOfRows inputs = InputsOf(found.fit.data, found.model, found.fit.weights);
  const HeldOutInput input{found.fit,
                           found.linear,
                           found.model,
                           found.candidates,
                           inputs,
                           found.unknown,
                           std::max<std::size_t>(3, found.best.blocks.size() + 2),
                           offered.has_value(),
                           task.options,
                           predicting};
  const Result<FittedModel> written = AsWritten(task, fit, diagnosis);
  if (!written) return Error{written.error()};
  const bool may_fade = !found.best.blocks.empty() || offered.has_value();  // checks may follow
  CorrectedModel corrected{written->model, written->errors, Validate(input, may_fade), 0,
                           inputs.units};
  if (task.Interrupted()) return Task::InterruptedError();
  diagnosis.rms_after_m = Rms(corrected.errors, fit.problem.weights);
  const bool admitted = offered && AdmitsDiscrepancy(corrected.validation, found.fit.weights);
  if (offered && !admitted) {
    corrected.validation = WithoutDiscrepancy(input, std::move(corrected.validation));
    diagnosis.notes.emplace_back(
        "a discrepancy model of the remaining residual was fitted but omitted: it does not improve "
        "the prediction of held-out regions or sessions");
  }
  // The error by shrinking and limiting the curves applies to the held-out rows, too.
  AddError(RmsBeyond(diagnosis.rms_after_m, Rms(fit.errors, fit.problem.weights)),
           corrected.validation);
  AddHeldOutErrors(corrected.validation, diagnosis);
  if (!diagnosis.findings.empty() && diagnosis.withheld.empty()) {
    diagnosis.withheld = ReasonToWithhold(corrected.validation, HasEmpiricalTerm(diagnosis));
  }
  if (!admitted || !diagnosis.withheld.empty()) return corrected;
  const Result<FittedModel> whole = WithDiscrepancy(task, fit, *offered, diagnosis);
  if (!whole) return Error{whole.error()};
  corrected.model = whole->model;
  corrected.errors = whole->errors;
  corrected.discrepancy_parameters = offered->effective_parameters;
  diagnosis.rms_after_m = Rms(corrected.errors, fit.problem.weights);
  return corrected;
}

void Withhold(const FittedModel& declared, CorrectedModel& corrected, Diagnosis& diagnosis) {
  if (diagnosis.withheld.empty()) return;
  diagnosis.notes.push_back(diagnosis.withheld);
  corrected.model = declared.model;
  corrected.errors = declared.errors;
  diagnosis.rms_after_m = diagnosis.rms_before_m;
}

bool CausesConfirmed(const Diagnosis& diagnosis) {
  const bool open =
      diagnosis.verdict == Verdict::kUnknown || diagnosis.verdict == Verdict::kAmbiguous;
  return !open && diagnosis.discrepancy.empty();
}

namespace {

void Shrink(double share, const PerRow<Vec3>& before, PerRow<Vec3>& after) {
  for (const RowIndex row : after.indices())
    after[row] = before[row] + share * (after[row] - before[row]);
}

}  // namespace

bool RadiusCanBeStated(const Task& task, const Validation& validation, const Diagnosis& diagnosis) {
  if (validation.errors.empty()) return false;
  const bool away = validation.errors.back().by != validation.schemes.front().by;
  return away && (task.data.instrument_used() || diagnosis.not_observable.empty());
}

void ShrinkUnconfirmed(const Task& task, const Identified& found, const FitOfAllRows& fit,
                       const FittedModel& declared, CorrectedModel& corrected,
                       Diagnosis& diagnosis) {
  Validation& validation = corrected.validation;
  if (CausesConfirmed(diagnosis) || !diagnosis.withheld.empty()) return;
  if (!RadiusCanBeStated(task, validation, diagnosis)) return;
  const FitProblem& searched = found.fit;
  const auto decisive = std::ranges::find_if(validation.schemes, [&](const HeldOut& scheme) {
    return scheme.by == validation.errors.front().by;
  });
  const double share = BestShare(*decisive, searched.weights);
  if (share <= 0) {
    diagnosis.withheld =
        "no share of the correction predicts held-out rows better than the declared model: no "
        "correction is written; find the cause first";
    Withhold(declared, corrected, diagnosis);
    return;
  }
  for (HeldOut& scheme : validation.schemes) Shrink(share, scheme.before, scheme.after);
  if (validation.halves) Shrink(share, validation.halves->before, validation.halves->after);
  Shrink(share, declared.errors, corrected.errors);
  validation.errors.clear();
  for (const HeldOut& scheme : validation.schemes) {
    if (const auto error = ErrorOf(searched, scheme, task.options.bootstrap))
      validation.errors.push_back(*error);
  }
  AddError(share * std::exchange(validation.added_error_m, 0), validation);
  AddHeldOutErrors(validation, diagnosis);
  diagnosis.rms_after_m = Rms(corrected.errors, fit.problem.weights);
  diagnosis.domain.applied_share = share;
  constexpr double kNotable = 0.95;
  if (share >= kNotable) return;
  diagnosis.notes.push_back(
      fmt::format("{} of the correction is applied at the measured poses: its causes are not "
                  "confirmed, and this share predicts held-out rows best",
                  PercentText(share)));
}

}  // namespace plumbline::measure
