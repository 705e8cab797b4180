#include "app/measure/siblings/stated_errors.h"

#include <cmath>
#include <map>
#include <numeric>

#include "app/measure/diagnosis/residual_layout.h"

namespace plumbline::measure {

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
    for (const HeldOutError& of : without.held_out_by_all) {
      if (of.by == error.by) error.before_m = of.before_m;
    }
  }
  for (KindError& error : with.rms_by_kind) {
    for (const KindError& of : without.rms_by_kind) {
      if (of.kind != error.kind) continue;
      error.before_m = of.before_m;
      error.before_held_out_m = of.before_held_out_m;
    }
  }
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
  for (std::optional<double>* sigma_m :
       {&domain.residual_sigma_m, &domain.distant_sigma_m, &domain.declared_sigma_m}) {
    if (*sigma_m) **sigma_m *= factor;
  }
}

std::optional<double> HeldOutOf(const Diagnosis& answer) {
  if (answer.held_out_by.empty()) return std::nullopt;
  return answer.withheld.empty() ? answer.held_out.after_m : answer.held_out.before_m;
}

}  // namespace plumbline::measure
