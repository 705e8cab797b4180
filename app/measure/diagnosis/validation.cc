#include "app/measure/diagnosis/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/robust.h"
#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {
namespace {

std::vector<HeldOutError> ErrorsOfSchemes(const HeldOutInput& input,
                                          const std::vector<HeldOut>& schemes) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& scheme : schemes) {
    const auto error = ErrorOf(input.problem, scheme, input.options.bootstrap);
    if (error) errors.push_back(*error);
  }
  return errors;
}

/// Sums of squared errors of the predicted rows, with and without the discrepancy model.
std::pair<double, double> SquaresOf(const HeldOut& scheme, const PerRow<double>& weights) {
  double with = 0, without = 0;
  for (const RowIndex row : scheme.after.indices()) {
    if (!scheme.predicted[row] || weights[row] < kOutlierWeight) continue;
    with += scheme.after[row].squaredNorm();
    without += scheme.after_named[row].squaredNorm();
  }
  return {with, without};
}

}  // namespace

Validation Validate(const HeldOutInput& input, bool with_halves) {
  const Dataset& data = input.problem.data;
  const std::vector<FoldPlan> plans = {BlocksOfTime(data), RegionsOfJointSpace(data),
                                       Sessions(data), Places(data)};
  const FoldPlan halves = with_halves ? OppositeHalves(data) : FoldPlan{};
  double all_folds = halves.folds, done_folds = 0;
  for (const FoldPlan& plan : plans) all_folds += plan.folds;
  const auto hold_out = [&](const FoldPlan& plan) {
    HeldOutInput part = input;
    part.progress = [&](double share) {
      if (input.progress) input.progress((done_folds + share * plan.folds) / all_folds);
    };
    HeldOut held_out = HoldOut(part, plan);
    done_folds += plan.folds;
    return held_out;
  };
  Validation validation;
  for (const FoldPlan& plan : plans) {
    if (plan.folds > 0) validation.schemes.push_back(hold_out(plan));
  }
  validation.errors = ErrorsOfSchemes(input, validation.schemes);
  if (halves.folds > 0) validation.halves = hold_out(halves);
  return validation;
}

void AddError(double added_error_m, Validation& validation) {
  validation.added_error_m = std::hypot(validation.added_error_m, added_error_m);
  for (HeldOutError& error : validation.errors) {
    for (double* rms_m : {&error.after_m, &error.after_low_m, &error.after_high_m}) {
      *rms_m = std::hypot(*rms_m, added_error_m);
    }
  }
}

bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights) {
  const auto lowers = [&](const HeldOut& scheme) {
    const auto [with, without] = SquaresOf(scheme, weights);
    return with < without;
  };
  bool any_beyond = false;  // regions or sessions were predicted
  for (std::size_t scheme = 1; scheme < validation.schemes.size(); ++scheme) {
    const PerRow<bool>& predicted = validation.schemes[scheme].predicted;
    if (std::ranges::find(predicted, true) == predicted.end()) continue;
    if (!lowers(validation.schemes[scheme])) return false;
    any_beyond = true;
  }
  return any_beyond || (!validation.schemes.empty() && lowers(validation.schemes.front()));
}

Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation) {
  for (HeldOut& scheme : validation.schemes) scheme.after = scheme.after_named;
  if (validation.halves) validation.halves->after = validation.halves->after_named;
  validation.errors = ErrorsOfSchemes(input, validation.schemes);
  return validation;
}

std::string ReasonToWithhold(const Validation& validation, bool empirical) {
  if (validation.errors.empty()) {
    return "too few rows to hold any out: the correction cannot be validated, and none is written; "
           "measure more poses, spread over the cell";
  }
  const auto between_rows = [&](const HeldOutError& error) {
    return error.by == validation.schemes.front().by;
  };
  const bool any_between = std::ranges::any_of(validation.errors, between_rows);
  for (const HeldOutError& error : validation.errors) {
    if (!empirical && any_between && !between_rows(error)) continue;
    if (error.after_m <= error.before_m) continue;
    return fmt::format(
        "held out by {}, the corrected model has an error of {} mm, the declared model {} mm: no "
        "correction is written; find the cause first",
        error.by, MillimetreText(error.after_m), MillimetreText(error.before_m));
  }
  return {};
}

}  // namespace plumbline::measure
