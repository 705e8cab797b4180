#include "app/measure/diagnosis/joint_step.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "firmware-like/geometry/angle.h"

namespace plumbline::measure {
namespace {

constexpr double kCoarsest_deg = 0.2;
constexpr double kLargestLog10Chance = -6;
constexpr double kRounding_deg = 1e-9;  // of the conversion deg -> rad -> deg, over many turns
constexpr double kTurn_deg = 360;

/// Usual steps, coarsest first.
std::vector<double> UsualSteps_deg() {
  std::vector<double> steps;
  for (int power = 1; power >= -5; --power) {
    for (const double digit : {5.0, 2.0, 1.0}) {
      const double step = digit * std::pow(10.0, power);
      steps.push_back(step);                      // deg
      steps.push_back(1e-3 * step / kRadPerDeg);  // mrad
    }
  }
  for (int bits = 10; bits <= 20; ++bits) steps.push_back(std::ldexp(kTurn_deg, -bits));
  std::ranges::sort(steps, std::greater<>());
  return steps;
}

/// Distinct readings of every revolute joint, without zeros (multiples of any step).
std::vector<double> DistinctReadings_deg(const MeasuredTable& table,
                                         const std::vector<model::Joint>& joints) {
  std::vector<double> readings;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].type == model::JointType::kPrismatic) continue;
    std::vector<double> values;
    for (const MeasuredRow& row : table.rows) {
      const double value = row.q[static_cast<Eigen::Index>(i)] / kRadPerDeg;
      if (std::abs(value) > kRounding_deg) values.push_back(value);
    }
    std::ranges::sort(values);
    const auto same = [](double a, double b) { return std::abs(a - b) <= kRounding_deg; };
    values.erase(std::unique(values.begin(), values.end(), same), values.end());
    readings.insert(readings.end(), values.begin(), values.end());
  }
  return readings;
}

bool AllMultiples(const std::vector<double>& readings, double step, double tolerance) {
  return std::ranges::all_of(readings, [&](double value) {
    return std::abs(value - step * std::round(value / step)) <= tolerance;
  });
}

}  // namespace

std::optional<JointStep> JointStepOf(const MeasuredTable& table,
                                     const std::vector<model::Joint>& joints) {
  if (!table.q_decimals) return std::nullopt;
  const std::vector<double> readings = DistinctReadings_deg(table, joints);
  if (readings.empty()) return std::nullopt;
  const int count = static_cast<int>(readings.size());
  const double written_deg = std::pow(10.0, -*table.q_decimals);
  const std::vector<double> steps = UsualSteps_deg();
  for (const double step_deg : steps) {
    if (step_deg < 1.5 * written_deg) break;
    if (!AllMultiples(readings, step_deg, 0.5 * written_deg + kRounding_deg)) continue;
    const double log10_chance =
        std::log10(static_cast<double>(steps.size())) + count * std::log10(written_deg / step_deg);
    if (log10_chance > kLargestLog10Chance) continue;
    if (step_deg > kCoarsest_deg) return std::nullopt;
    return JointStep{step_deg * kRadPerDeg, false, log10_chance, count};
  }
  if (written_deg > kCoarsest_deg) return std::nullopt;
  return JointStep{written_deg * kRadPerDeg, true, 0, count};
}

}  // namespace plumbline::measure
