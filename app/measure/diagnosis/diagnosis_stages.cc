#include "app/measure/diagnosis/diagnosis_stages.h"

#include <cmath>

#include "app/measure/diagnosis/thresholds.h"

namespace plumbline::measure {

double Rms(const PerRow<Vec3>& errors, const PerRow<double>& weights) {
  double sum = 0, count = 0;
  for (const RowIndex row : errors.indices()) {
    if (weights[row] < kOutlierWeight) continue;
    sum += errors[row].squaredNorm();
    count += 1;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

double RmsBetween(PerRow<Vec3> a, const PerRow<Vec3>& b, const PerRow<double>& weights) {
  for (const RowIndex row : a.indices()) a[row] -= b[row];
  return Rms(a, weights);
}

std::optional<double> TimeZeroOf(const model::CellModel& cell) {
  return cell.domain ? cell.domain->time_zero_s : std::nullopt;
}

}  // namespace plumbline::measure
