#include "app/measure/siblings/prior_answer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "app/measure/diagnosis/data/observations.h"
#include "app/measure/diagnosis/validation/diagnosis_stages.h"

namespace plumbline::measure {
namespace {

void TakeDeclaredFrames(model::SessionFrames& frames) {
  if (frames.X_WB_declared) frames.X_WB = *std::exchange(frames.X_WB_declared, std::nullopt);
  for (model::SessionTip& tip : frames.tips) {
    if (tip.declared_F) tip.p_F = *std::exchange(tip.declared_F, std::nullopt);
  }
}

void AsDeclared(HeldOutError& error) {
  const double ratio = error.after_m > 0 ? error.before_m / error.after_m : 1;
  for (double* value : {&error.after_m, &error.after_low_m, &error.after_high_m}) *value *= ratio;
}

}  // namespace

bool WithheldByHeldOutRows(const Diagnosis& diagnosis) {
  return !diagnosis.withheld.empty() &&
         std::ranges::any_of(diagnosis.held_out_by_all, [](const HeldOutError& error) {
           return error.after_m >= error.before_m;
         });
}

void RemoveUnconfirmed(Diagnosis& with) {
  if (CausesConfirmed(with) && with.withheld.empty()) return;
  std::vector<std::string> ids;
  for (const Finding& finding : with.findings)
    ids.emplace_back(finding.effect.term.effect->traits().id);
  if (!with.discrepancy.empty()) ids.emplace_back("a discrepancy model");
  if (!ids.empty()) {
    with.notes.push_back(fmt::format(
        "besides what other arms have in common, these rows suggest {}, which is not written: {}",
        fmt::join(ids, ", "),
        with.withheld.empty() ? "the cause is not confirmed; measure more rows" : with.withheld));
  }
  with.withheld.clear();
  with.findings.clear();
  with.finding_names.clear();
  with.correlation.resize(0, 0);
  with.discrepancy.clear();
  with.discrepancy_parameters = with.discrepancy_share = 0;
  with.rivals.clear();
  with.rival_drivers.clear();
  with.rival_separations.clear();
  with.doubts.clear();
  std::erase_if(with.checks, [](const ExplanationCheck& check) { return !check.effect.empty(); });
  for (CandidateOutcome& outcome : with.considered) {
    if (std::exchange(outcome.taken, false)) outcome.reason = "not confirmed";
  }
  AsDeclared(with.held_out);
  for (HeldOutError& error : with.held_out_by_all) AsDeclared(error);
  for (KindError& error : with.rms_by_kind) {
    error.after_m = error.before_m;
    error.after_held_out_m = error.before_held_out_m;
  }
  with.rms_after_m = with.rms_before_m;
  for (RowTrace& row : with.rows) {
    row.after = row.before;
    row.held_out_after = row.held_out_before;
  }
  for (model::SessionFrames& frames : with.sessions) TakeDeclaredFrames(frames);
  model::Domain& domain = with.domain;
  if (domain.residual_sigma_m && domain.declared_sigma_m)
    *domain.residual_sigma_m = std::max(*domain.residual_sigma_m, *domain.declared_sigma_m);
  domain.declared_sigma_m.reset();
  domain.applied_share = domain.covariance_share = 1;
}

std::optional<double> HeldOutOf(const Diagnosis& answer) {
  if (answer.held_out_by.empty()) return std::nullopt;
  return answer.withheld.empty() ? answer.held_out.after_m : answer.held_out.before_m;
}

std::optional<double> GainInStandardErrors(const Diagnosis& with, const Diagnosis& without,
                                           double factor) {
  const auto written = [](const Diagnosis& answer, const RowTrace& row) {
    return answer.withheld.empty() ? row.held_out_after : row.held_out_before;
  };
  std::map<int, double> square_without;
  for (const RowTrace& row : without.rows) {
    if (!row.outlier && written(without, row)) {
      square_without[row.line] = written(without, row)->squaredNorm();
    }
  }
  std::vector<double> gains;
  for (const RowTrace& row : with.rows) {
    if (!written(with, row) || row.outlier || !square_without.contains(row.line)) continue;
    gains.push_back(square_without.at(row.line) -
                    factor * factor * written(with, row)->squaredNorm());
  }
  if (gains.size() < 3) return std::nullopt;
  const double count = static_cast<double>(gains.size());
  const double mean = std::accumulate(gains.begin(), gains.end(), 0.0) / count;
  double squares = 0;
  for (const double gain : gains) squares += std::pow(gain - mean, 2);
  const double error = std::sqrt(squares / (count - 1) / count);
  return error > 0 ? mean / error : 0;
}

std::optional<double> FactorForNewRows(double parameters, const Diagnosis& diagnosis) {
  double residuals = 0;
  for (const RowTrace& row : diagnosis.rows) {
    residuals += row.outlier ? 0 : ResidualsOf(row.kind);
  }
  if (residuals < parameters + 1) return std::nullopt;
  return std::sqrt((residuals + parameters) / (residuals - parameters));
}

void Widen(double factor, Diagnosis& diagnosis) {
  const auto widen = [factor](HeldOutError& error) {
    for (double* value :
         {&error.before_m, &error.after_m, &error.after_low_m, &error.after_high_m}) {
      *value *= factor;
    }
  };
  widen(diagnosis.held_out);
  for (HeldOutError& error : diagnosis.held_out_by_all) widen(error);
  for (KindError& error : diagnosis.rms_by_kind) {
    if (error.before_held_out_m) *error.before_held_out_m *= factor;
    if (error.after_held_out_m) *error.after_held_out_m *= factor;
  }
  model::Domain& domain = diagnosis.domain;
  for (std::optional<double>* sigma_m : {&domain.residual_sigma_m, &domain.distant_sigma_m,
                                         &domain.range_growth_m, &domain.declared_sigma_m}) {
    if (*sigma_m) **sigma_m *= factor;
  }
  for (std::optional<model::MeasuredRange>* input :
       {&domain.payload_kg, &domain.temp_C, &domain.t_s}) {
    if (*input && (*input)->growth) *(*input)->growth *= factor;
  }
  for (model::MeasuredTorque& torque : domain.torques) {
    if (torque.range.growth) *torque.range.growth *= factor;
  }
}

void StateErrorsBefore(const Diagnosis& without, Diagnosis& with) {
  std::map<int, Vec3> before;
  std::map<int, std::optional<Vec3>> held_out_before;
  for (const RowTrace& row : without.rows) {
    before[row.line] = row.before;
    held_out_before[row.line] = row.held_out_before;
  }
  for (RowTrace& row : with.rows) {
    if (!before.contains(row.line)) continue;
    row.before = before.at(row.line);
    row.held_out_before = held_out_before.at(row.line);
  }
  with.rms_before_m = without.rms_before_m;
  with.held_out.before_m = without.held_out.before_m;
  for (HeldOutError& error : with.held_out_by_all) {
    for (const HeldOutError& alone : without.held_out_by_all) {
      if (alone.by == error.by) error.before_m = alone.before_m;
    }
  }
  for (KindError& error : with.rms_by_kind) {
    for (const KindError& alone : without.rms_by_kind) {
      if (alone.kind != error.kind) continue;
      error.before_m = alone.before_m;
      error.before_held_out_m = alone.before_held_out_m;
    }
  }
}

}  // namespace plumbline::measure
