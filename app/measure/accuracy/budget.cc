#include "app/measure/accuracy/budget.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Effective degrees of freedom: u_c^4 / sum u_i^4 / freedom_i.
double EffectiveFreedom(const std::vector<BudgetLine>& lines, double combined_m) {
  double sum = 0;
  for (const BudgetLine& line : lines) {
    if (line.freedom > 0) sum += std::pow(line.u_m, 4) / line.freedom;
  }
  return sum > 0 ? std::pow(combined_m, 4) / sum : kInfinite;
}

double Combined(const std::vector<BudgetLine>& lines) {
  double square = 0;
  for (const BudgetLine& line : lines) square += line.u_m * line.u_m;
  return std::sqrt(square);
}

double CoverageFactor(double freedom) {
  return statistics::StudentCoverageFactor(statistics::kTwoSigmaCoverage, std::max(1.0, freedom));
}

/// Of a difference. Lines of one source share one estimate of their standard deviation, and thus
/// its degrees of freedom.
Uncertainty UncertaintyOf(const std::vector<BudgetLine>& lines) {
  std::vector<BudgetLine> by_source;
  for (const BudgetLine& line : lines) {
    const auto same = std::ranges::find_if(
        by_source, [&](const BudgetLine& known) { return known.source == line.source; });
    if (same == by_source.end()) {
      by_source.push_back(line);
    } else {
      same->u_m = std::hypot(same->u_m, line.u_m);
    }
  }
  const double combined_m = Combined(by_source);
  return {combined_m, CoverageFactor(EffectiveFreedom(by_source, combined_m))};
}

BudgetLine RepeatabilityLine(const Characteristics& characteristics,
                             const Contributions& contributions, int cycles) {
  if (characteristics.cycle_degrees_of_freedom == 0) {
    return {Source::kRepeatability, contributions.residual_m,
            contributions.residual_degrees_of_freedom};
  }
  return {Source::kRepeatability, characteristics.cycle_sigma_m / std::sqrt(cycles),
          static_cast<double>(characteristics.cycle_degrees_of_freedom)};
}

}  // namespace

Budget BudgetOf(const Characteristics& characteristics, const Contributions& contributions,
                int cycles) {
  Budget budget;
  budget.instrument_known = contributions.instrument_m.has_value();
  budget.repeatability_shown = characteristics.cycle_degrees_of_freedom > 0;
  if (contributions.instrument_m) {
    budget.lines.push_back({Source::kInstrument, *contributions.instrument_m, kInfinite});
  }
  budget.lines.push_back({Source::kJointReading, contributions.joint_reading_m, kInfinite});
  budget.lines.push_back(RepeatabilityLine(characteristics, contributions, cycles));
  const double leverage =
      contributions.lengths > 0 ? contributions.parameters / contributions.lengths : 0;
  budget.lines.push_back({Source::kModel, contributions.residual_m * std::sqrt(leverage),
                          contributions.residual_degrees_of_freedom});
  budget.combined_m = Combined(budget.lines);
  budget.freedom = EffectiveFreedom(budget.lines, budget.combined_m);
  budget.coverage_factor = CoverageFactor(budget.freedom);
  return budget;
}

Uncertainty RepeatabilityUncertainty(const PoseCharacteristics& pose) {
  return {pose.repeatability_u_m, CoverageFactor(pose.cycles - 1)};
}

Uncertainty DistanceUncertainty(const Characteristics& characteristics,
                                const Contributions& contributions) {
  std::vector<BudgetLine> lines;
  if (!characteristics.distance) return {};
  for (const std::size_t at : {characteristics.distance->from, characteristics.distance->to}) {
    const Budget budget =
        BudgetOf(characteristics, contributions, characteristics.poses[at].cycles);
    lines.insert(lines.end(), budget.lines.begin(), budget.lines.end());
  }
  return UncertaintyOf(lines);
}

Uncertainty DriftUncertainty(const Characteristics& characteristics,
                             const Contributions& contributions) {
  std::vector<BudgetLine> lines;
  if (!characteristics.drift) return {};
  for (const int cycles :
       {characteristics.drift->first_cycles, characteristics.drift->last_cycles}) {
    lines.push_back(RepeatabilityLine(characteristics, contributions, cycles));
    if (contributions.instrument_m) {
      lines.push_back({Source::kInstrument, *contributions.instrument_m, kInfinite});
    }
  }
  return UncertaintyOf(lines);
}

}  // namespace plumbline::measure
