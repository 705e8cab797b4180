#include "app/diagnosis/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/diagnosis/diagnosis_text.h"
#include "app/diagnosis/robust.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {
namespace {

std::vector<HeldOutError> ErrorsOfWays(const HeldOutInput& input,
                                       const std::vector<HeldOut>& ways) {
  std::vector<HeldOutError> errors;
  for (const HeldOut& way : ways) {
    const auto error = ErrorOf(input.problem, way, input.options.bootstrap);
    if (error) errors.push_back(*error);
  }
  return errors;
}

/// Sums of squares over predicted rows, with the discrepancy model and without.
std::pair<double, double> SquaresOf(const HeldOut& way, const PerRow<double>& weights) {
  double with = 0, without = 0;
  for (const RowIndex row : way.after.indices()) {
    if (!way.predicted[row] || weights[row] < kOutlierWeight) continue;
    with += way.after[row].squaredNorm();
    without += way.after_named[row].squaredNorm();
  }
  return {with, without};
}

}  // namespace

Validation Validate(const HeldOutInput& input, bool with_halves) {
  const Dataset& data = input.problem.data;
  Validation validation;
  for (const FoldPlan& plan : {BlocksOfTime(data), RegionsOfJointSpace(data), Sessions(data)}) {
    if (plan.folds > 0) validation.ways.push_back(HoldOut(input, plan));
  }
  validation.errors = ErrorsOfWays(input, validation.ways);
  const FoldPlan halves = with_halves ? OppositeHalves(data) : FoldPlan{};
  if (halves.folds > 0) validation.halves = HoldOut(input, halves);
  return validation;
}

void AddError(double lost_m, Validation& validation) {
  validation.lost_m = std::hypot(validation.lost_m, lost_m);
  for (HeldOutError& error : validation.errors) {
    for (double* rms_m : {&error.after_m, &error.after_low_m, &error.after_high_m}) {
      *rms_m = std::hypot(*rms_m, lost_m);
    }
  }
}

bool AdmitsDiscrepancy(const Validation& validation, const PerRow<double>& weights) {
  const auto lowers = [&](const HeldOut& way) {
    const auto [with, without] = SquaresOf(way, weights);
    return with < without;
  };
  bool beyond = false;  // regions or sessions were predicted
  for (std::size_t way = 1; way < validation.ways.size(); ++way) {
    const PerRow<bool>& predicted = validation.ways[way].predicted;
    if (std::find(predicted.begin(), predicted.end(), true) == predicted.end()) continue;
    if (!lowers(validation.ways[way])) return false;
    beyond = true;
  }
  return beyond || (!validation.ways.empty() && lowers(validation.ways.front()));
}

Validation WithoutDiscrepancy(const HeldOutInput& input, Validation validation) {
  for (HeldOut& way : validation.ways) way.after = way.after_named;
  if (validation.halves) validation.halves->after = validation.halves->after_named;
  validation.errors = ErrorsOfWays(input, validation.ways);
  return validation;
}

std::string ReasonToWithhold(const Validation& validation, bool empirical) {
  if (validation.errors.empty()) {
    return "too few rows to hold any out: nothing tests the correction, and none is written; "
           "measure "
           "more poses, spread over the cell";
  }
  const auto between_rows = [&](const HeldOutError& error) {
    return error.by == validation.ways.front().by;
  };
  const bool any_between =
      std::any_of(validation.errors.begin(), validation.errors.end(), between_rows);
  for (const HeldOutError& error : validation.errors) {
    if (!empirical && any_between && !between_rows(error)) continue;
    if (error.after_m <= error.before_m) continue;
    return fmt::format(
        "held out by {}, the corrected model errs by {} mm, the declared one by {} mm: no "
        "correction is written; find the cause first",
        error.by, MillimetreText(error.after_m), MillimetreText(error.before_m));
  }
  return {};
}

}  // namespace plumbline::diagnosis
