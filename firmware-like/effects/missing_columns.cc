#include "firmware-like/effects/missing_columns.h"

#include <algorithm>

namespace plumbline::effects {
namespace {

constexpr double kAfterAnyEvent_s = 1e9;
constexpr double kHallVariation_K = 10;  // where no temperature range is known

void AddMissing(std::vector<MissingColumn>& missing, const MissingColumn& one) {
  const auto known = std::find_if(missing.begin(), missing.end(), [&](const MissingColumn& other) {
    return other.column == one.column;
  });
  if (known == missing.end()) {
    missing.push_back(one);
    return;
  }
  known->range.low = std::min(known->range.low, one.range.low);
  known->range.high = std::max(known->range.high, one.range.high);
}

model::Interval TemperaturesOf(const model::CellModel& cell, const Conditions& conditions) {
  if (cell.domain && cell.domain->temp_C) return *cell.domain->temp_C;
  const double middle = conditions.reference_temperature_C.value_or(20);
  return {middle - kHallVariation_K, middle + kHallVariation_K};
}

}  // namespace

std::vector<MissingColumn> MissingColumns(std::span<const ActiveEffect> effects,
                                          const Conditions& conditions,
                                          const model::CellModel& cell) {
  std::vector<MissingColumn> missing;
  for (const ActiveEffect& active : effects) {
    const EffectTraits& traits = active.term.effect->traits();
    const std::string id(traits.id);
    if (ReadsTime(active.term) && !conditions.t_s) {
      AddMissing(missing,
                 {"t_s", id, active.seen_t_s.value_or(model::Interval{0, kAfterAnyEvent_s})});
    }
    if (traits.Needs(Signal::kTemperature) && !conditions.temp_C)
      AddMissing(missing, {"temp_C", id, TemperaturesOf(cell, conditions)});
    for (std::size_t k = 0; k < active.term.drivers.size(); ++k) {
      const std::string& driver = active.term.drivers[k];
      const auto column = static_cast<Eigen::Index>(k);
      if (conditions.Signal(driver) || column >= active.term.nodes.cols()) continue;
      const auto nodes = active.term.nodes.col(column);
      AddMissing(missing, {driver, id, {nodes.minCoeff(), nodes.maxCoeff()}});
    }
  }
  return missing;
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
