#include "app/measure/diagnosis/kind_errors.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace plumbline::measure {
namespace {

/// Sums of squares over the rows of one kind [m^2].
struct KindSums {
  double rows = 0, before = 0, after = 0, noise = 0;
  double held_out = 0, before_held_out = 0, after_held_out = 0;
};

void Add(const RowTrace& trace, double relative_noise, KindSums& sums) {
  sums.rows += 1;
  sums.before += trace.before.squaredNorm();
  sums.after += trace.after.squaredNorm();
  sums.noise += relative_noise;
  if (!trace.held_out_before || !trace.held_out_after) return;
  sums.held_out += 1;
  sums.before_held_out += trace.held_out_before->squaredNorm();
  sums.after_held_out += trace.held_out_after->squaredNorm();
}

KindError ErrorOf(const std::string& kind, const KindSums& sums, double sigma_m) {
  KindError error;
  error.kind = kind;
  error.rows = static_cast<int>(sums.rows);
  error.before_m = std::sqrt(sums.before / sums.rows);
  error.after_m = std::sqrt(sums.after / sums.rows);
  error.noise_floor_m = sigma_m * std::sqrt(sums.noise / sums.rows);
  if (sums.held_out == 0) return error;
  error.before_held_out_m = std::sqrt(sums.before_held_out / sums.held_out);
  error.after_held_out_m = std::sqrt(sums.after_held_out / sums.held_out);
  return error;
}

}  // namespace

std::vector<KindError> KindErrorsOf(const Dataset& data, const Diagnosis& diagnosis) {
  std::map<std::string, KindSums> sums;
  for (const RowIndex row : diagnosis.rows.indices()) {
    const RowTrace& trace = diagnosis.rows[row];
    if (trace.outlier) continue;
    Add(trace, data.numbers[row].LengthVariance(), sums[Describe(trace.kind)]);
  }
  const double sigma_m = data.sigma_m > 0 ? data.sigma_m : diagnosis.sigma_m;
  std::vector<KindError> errors;
  errors.reserve(sums.size());
  for (const auto& [kind, of] : sums) errors.push_back(ErrorOf(kind, of, sigma_m));
  std::stable_sort(errors.begin(), errors.end(),
                   [](const KindError& a, const KindError& b) { return a.rows > b.rows; });
  return errors;
}

void AddKindErrors(const Dataset& data, Diagnosis& diagnosis) {
  diagnosis.rms_by_kind = KindErrorsOf(data, diagnosis);
  if (diagnosis.rms_by_kind.size() < 2) return;
  const KindError& most = diagnosis.rms_by_kind.front();
  diagnosis.rms_before_m = most.before_m;
  diagnosis.rms_after_m = most.after_m;
  diagnosis.noise_floor_m = most.noise_floor_m;
  // The most frequent kind of which rows were held out.
  const auto held_out =
      std::find_if(diagnosis.rms_by_kind.begin(), diagnosis.rms_by_kind.end(),
                   [](const KindError& of) { return of.before_held_out_m.has_value(); });
  if (held_out == diagnosis.rms_by_kind.end()) return;
  diagnosis.held_out.before_m = *held_out->before_held_out_m;
  diagnosis.held_out.after_m = *held_out->after_held_out_m;
}

}  // namespace plumbline::measure
