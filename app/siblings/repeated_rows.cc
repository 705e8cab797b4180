#include "app/siblings/repeated_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace plumbline::siblings {
namespace {

using Key = std::pair<std::string, std::vector<double>>;

/// A row's joints and readings in units of their tolerances.
Key KeyOf(const table::MeasuredRow& row) {
  constexpr double kTolerance = 1e-6;  // [rad] or [m]
  constexpr double kAbsent = HUGE_VAL;
  std::vector<double> numbers(row.q.begin(), row.q.end());
  const Vec3 p = row.measured_W.value_or(Vec3::Constant(kAbsent));
  numbers.insert(numbers.end(), p.begin(), p.end());
  numbers.push_back(row.range_m.value_or(kAbsent));
  numbers.push_back(row.gauge_m.value_or(kAbsent));
  for (double& number : numbers) number = std::round(number / kTolerance);
  return {row.artefact, numbers};
}

}  // namespace

std::size_t RepeatedRows(const table::MeasuredTable& a, const table::MeasuredTable& b) {
  std::map<Key, std::size_t> left;
  for (const table::MeasuredRow& row : a.rows) ++left[KeyOf(row)];
  std::size_t repeated = 0;
  for (const table::MeasuredRow& row : b.rows) {
    const auto found = left.find(KeyOf(row));
    if (found == left.end() || found->second == 0) continue;
    --found->second;
    ++repeated;
  }
  return repeated;
}

bool IsRepeated(std::size_t repeated, std::size_t rows_a, std::size_t rows_b) {
  constexpr std::size_t kLeast = 3, kShare = 10;
  return repeated >= kLeast && kShare * repeated > std::min(rows_a, rows_b);
}

}  // namespace plumbline::siblings
