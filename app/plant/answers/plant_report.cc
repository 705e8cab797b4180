#include "app/plant/answers/plant_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace plumbline::plant {
namespace {

constexpr int kSeries = 4;          ///< size, x, y, z
constexpr int kFewestSiblings = 5;  ///< below, no comparison with cells of the same arm model
constexpr int kThirds = 3;

/// Mean size of the residuals, or of one component, of each `bin` days of a period that have enough
/// probes.
std::vector<DayValue> Means(const ReportedCell& cell, int first_day, int last_day, int bin,
                            int series = 0) {
  std::vector<DayValue> means;
  double sum = 0;
  std::int64_t probes = 0;
  const DaySums* begin = nullptr;  // of the bin that is being summed
  const auto end_bin = [&] {
    if (begin != nullptr && probes >= kMinDayProbes && std::isfinite(sum)) {
      means.push_back({double(begin->day), sum / static_cast<double>(probes), begin->model});
    }
    sum = 0;
    probes = 0;
  };
  for (const DaySums& day : cell.days) {
    if (day.day < first_day || day.day > last_day) continue;
    const bool same = begin != nullptr && begin->model == day.model &&
                      (begin->day - first_day) / bin == (day.day - first_day) / bin;
    if (!same) {
      end_bin();
      begin = &day;
    }
    probes += day.probes;
    sum += series == 0   ? day.sum_mm
           : series == 1 ? day.sum_dx_mm
           : series == 2 ? day.sum_dy_mm
                         : day.sum_dz_mm;
  }
  end_bin();
  return means;
}

/// Of the period itself.
std::vector<DayValue> Means(const ReportedCell& cell, const ReportPeriod& period, int series = 0) {
  return Means(cell, period.first_day, period.last_day, period.bin_days(), series);
}

std::vector<double> ValuesOf(const std::vector<DayValue>& days) {
  std::vector<double> values;
  for (const DayValue& day : days) values.push_back(day.value);
  return values;
}

std::string AgeGroup(const std::optional<double>& years) {
  if (!years) return "";
  if (*years < 2) return "below 2 years";
  if (*years < 5) return "2 to 5 years";
  return *years < 10 ? "5 to 10 years" : "10 years or more";
}

/// Groups by arm model, series and age that cells with an answer belong to.
template <typename Answers, typename ValueOf>
std::vector<GroupAnswer> GroupAnswers(const Answers& answers, ValueOf value_of) {
  std::map<std::pair<std::string, std::string>, std::vector<double>> groups;
  for (const auto& answer : answers) {
    const ReportedCell& cell = *answer.cell;
    const std::string series =
        cell.arm_series.empty() ? "" : cell.arm_model + " " + cell.arm_series;
    const std::pair<const char*, std::string> memberships[] = {
        {"arm model", cell.arm_model}, {"series", series}, {"age", AgeGroup(cell.age_years)}};
    for (const auto& [kind, name] : memberships) {
      if (!name.empty()) groups[{kind, name}].push_back(value_of(answer));
    }
  }
  std::vector<GroupAnswer> result;
  std::vector<double> p;
  for (const auto& [group, values] : groups) {
    result.push_back({group.first, group.second, static_cast<int>(values.size()),
                      MedianWithInterval(values), 1});
    if (result.back().median_mm) p.push_back(result.back().median_mm->p);
  }
  const std::vector<double> adjusted = HolmAdjusted(p);
  std::size_t next = 0;
  for (GroupAnswer& group : result) {
    if (group.median_mm) group.p_adjusted = adjusted[next++];
  }
  return result;
}

/// Adjusts the p of each answer over all, and sorts by it.
template <typename Answer>
void Adjust(std::vector<Answer>& answers, const std::function<double(const Answer&)>& size) {
  std::vector<double> p;
  for (const Answer& answer : answers) p.push_back(answer.p_adjusted);
  const std::vector<double> adjusted = HolmAdjusted(p);
  for (std::size_t k = 0; k < answers.size(); ++k) answers[k].p_adjusted = adjusted[k];
  std::stable_sort(answers.begin(), answers.end(), [&](const Answer& a, const Answer& b) {
    return a.p_adjusted != b.p_adjusted ? a.p_adjusted < b.p_adjusted : size(a) > size(b);
  });
}

std::optional<CellDrift> DriftOf(const ReportedCell& cell, const ReportPeriod& period) {
  CellDrift drift{&cell, {}, 0, 1};
  double squares = 0;
  for (int series = 0; series < kSeries; ++series) {
    const auto trend = TrendOf(Means(cell, period, series));
    if (!trend) return std::nullopt;
    drift.p_adjusted = std::min(drift.p_adjusted, kSeries * trend->p);
    if (series == 0) {
      drift.size_mm = *trend;
    } else {
      squares += trend->slope.value * trend->slope.value;
    }
  }
  drift.moves_mm = std::sqrt(squares);
  return drift;
}

void AddLevels(const ReportData& data, PlantReport& report) {
  for (const ReportedCell& cell : data.cells) {
    const auto level = MedianWithInterval(ValuesOf(Means(cell, data.period)));
    if (!level) continue;
    CellLevel found{&cell, level->median, 0, 0, 0};
    for (const DaySums& day : cell.days) {
      if (day.day < data.period.first_day) continue;
      found.max_mm = std::max(found.max_mm, day.max_mm);
      found.probes += day.probes;
      found.wild += day.wild;
    }
    report.levels.push_back(found);
  }
  std::stable_sort(
      report.levels.begin(), report.levels.end(),
      [](const CellLevel& a, const CellLevel& b) { return a.level_mm.value > b.level_mm.value; });
}

void AddShifts(const ReportData& data, PlantReport& report) {
  const ReportPeriod& period = data.period;
  if (period.compared_days == 0) return;
  for (const ReportedCell& cell : data.cells) {
    const auto before = Means(cell, period.first_day - period.compared_days, period.first_day - 1,
                              period.bin_days());
    const auto after = Means(cell, period);
    const auto shift = ShiftBetween(ValuesOf(before), ValuesOf(after));
    if (!shift) {
      ++report.too_few_shift_days;
      continue;
    }
    report.shifts.push_back({&cell, *shift, shift->p, before.back().group != after.back().group});
  }
  Adjust<CellShift>(report.shifts, [](const CellShift& shift) {
    return std::abs(shift.size_mm.difference.value);
  });
  report.shift_groups = GroupAnswers(
      report.shifts, [](const CellShift& shift) { return shift.size_mm.difference.value; });
}

/// Level of the other cells of the same arm model; nullopt if there are too few.
std::optional<GroupMedian> SiblingsLevel(const CellLevel& of, const PlantReport& report) {
  std::vector<double> levels;
  for (const CellLevel& other : report.levels) {
    if (other.cell != of.cell && other.cell->arm_model == of.cell->arm_model &&
        !of.cell->arm_model.empty()) {
      levels.push_back(other.level_mm.value);
    }
  }
  if (levels.size() < kFewestSiblings) return std::nullopt;
  return MedianWithInterval(levels);
}

/// What restoring the cell's own earlier level would reduce, but not below its siblings' level: a
/// rise that leaves a cell better than they are is no reason to stop it.
std::optional<Maintenance> MaintenanceOf(const CellLevel& level, const ReportPeriod& period,
                                         const PlantReport& report) {
  const std::vector<double> values = ValuesOf(Means(*level.cell, period));
  const std::size_t third = values.size() / kThirds;
  const double confidence = 1 - kSignificance / static_cast<double>(report.levels.size());
  const std::span<const double> all(values);
  const auto siblings = SiblingsLevel(level, report);
  if (const auto rise = ShiftBetween(all.first(third), all.last(third), confidence);
      rise && rise->difference.low > 0) {
    Maintenance found{level.cell, rise->difference,
                      fmt::format("rose within the period, {} against {} days", third, third)};
    if (!siblings) return found;
    auto now = ValuesOf(Means(*level.cell, period));
    now.erase(now.begin(), now.end() - static_cast<std::ptrdiff_t>(third));
    const auto present = MedianWithInterval(now);
    const double above =
        (present ? present->median.value : level.level_mm.value) - siblings->median.value;
    if (above <= 0) return std::nullopt;
    if (above < found.reduction_mm.value) {
      found.basis += "; down to its siblings' level only";
      found.reduction_mm.low = std::min(found.reduction_mm.low, above);
      found.reduction_mm.value = above;
      found.reduction_mm.high = std::max(above, found.reduction_mm.low);
    }
    return found;
  }
  if (!siblings) return std::nullopt;
  const Interval above{level.level_mm.value - siblings->median.value,
                       level.level_mm.low - siblings->median.high,
                       level.level_mm.high - siblings->median.low};
  if (above.low <= 0 || level.level_mm.value < 2 * siblings->median.value) return std::nullopt;
  return Maintenance{level.cell, above, "over twice its siblings' level; no rise seen"};
}

void AddMaintenance(const ReportData& data, PlantReport& report) {
  for (const CellLevel& level : report.levels) {
    if (auto found = MaintenanceOf(level, data.period, report)) {
      report.maintenance.push_back(std::move(*found));
    }
  }
  std::stable_sort(report.maintenance.begin(), report.maintenance.end(),
                   [](const Maintenance& a, const Maintenance& b) {
                     return a.reduction_mm.low > b.reduction_mm.low;
                   });
}

}  // namespace

PlantReport ReportOf(const ReportData& data) {
  PlantReport report;
  AddLevels(data, report);
  for (const ReportedCell& cell : data.cells) {
    if (auto drift = DriftOf(cell, data.period)) {
      report.drifts.push_back(*drift);
    } else {
      ++report.too_few_days;
    }
  }
  Adjust<CellDrift>(report.drifts, [](const CellDrift& drift) { return drift.moves_mm; });
  report.drift_groups =
      GroupAnswers(report.drifts, [](const CellDrift& drift) { return drift.size_mm.slope.value; });
  AddShifts(data, report);
  AddMaintenance(data, report);
  return report;
}

}  // namespace plumbline::plant
