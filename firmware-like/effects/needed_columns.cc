#include "firmware-like/effects/needed_columns.h"

#include <algorithm>

namespace plumbline::effects {
namespace {

constexpr double kAfterAnyEvent_s = 1e9;
constexpr double kHallVariation_K = 10;  // where no temperature range is known

void AddNeeded(std::vector<NeededColumn>& needed, const NeededColumn& one) {
  const auto known = std::ranges::find_if(
      needed, [&](const NeededColumn& other) { return other.column == one.column; });
  if (known == needed.end()) {
    needed.push_back(one);
    return;
  }
  known->range.low = std::min(known->range.low, one.range.low);
  known->range.high = std::max(known->range.high, one.range.high);
}

model::Interval TemperaturesOf(const model::CellModel& cell) {
  if (cell.domain && cell.domain->temp_C) return cell.domain->temp_C->Hull();
  const double middle = DeclaredConditions(cell).reference_temperature_C.value_or(20);
  return {middle - kHallVariation_K, middle + kHallVariation_K};
}

}  // namespace

std::vector<NeededColumn> NeededColumns(std::span<const ActiveEffect> effects,
                                        const model::CellModel& cell) {
  std::vector<NeededColumn> needed;
  for (const ActiveEffect& active : effects) {
    const EffectTraits& traits = active.term.effect->traits();
    const std::string id(traits.id);
    if (ReadsTime(active.term))
      AddNeeded(needed,
                {"t_s", id, active.seen_t_s.value_or(model::Interval{0, kAfterAnyEvent_s})});
    if (traits.Needs(Signal::kTemperature)) AddNeeded(needed, {"temp_C", id, TemperaturesOf(cell)});
    for (std::size_t k = 0; k < active.term.drivers.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      if (column >= active.term.nodes.cols() || active.term.nodes.rows() == 0) continue;
      const auto nodes = active.term.nodes.col(column);
      AddNeeded(needed, {active.term.drivers[k], id, {nodes.minCoeff(), nodes.maxCoeff()}});
    }
  }
  return needed;
}

Conditions WithColumn(Conditions conditions, const std::string& column, double value) {
  if (column == "t_s") {
    conditions.t_s = value;
  } else if (column == "temp_C") {
    conditions.temp_C = value;
  } else {
    conditions.further.push_back({column, value});
  }
  return conditions;
}

}  // namespace plumbline::effects
