#include "app/plant/answers/plant_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::plant {
namespace {

constexpr int kSeries = 4;          ///< size, x, y, z
constexpr int kFewestSiblings = 5;  ///< below, no comparison with cells of the same arm model
constexpr int kThirds = 3;
constexpr double kNormalOfMad = 1.4826;  ///< standard deviation of a median deviation of 1

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

/// Autocorrelation that the tests of each cell assume. One cell's days estimate it too badly for
/// the small p of many cells, so a cell has no less than 95 % of the plant's cells have, and no
/// less than its own days show.
std::vector<double> Autocorrelations(const std::vector<std::vector<DayValue>>& cells) {
  std::vector<double> own, known;
  double days_known = 0;
  for (const auto& days : cells) {
    const auto found = AutocorrelationOf(days);
    own.push_back(found.value_or(0));
    if (!found) continue;
    known.push_back(*found);
    days_known += static_cast<double>(days.size());
  }
  if (known.empty()) return own;
  const double median = statistics::MedianOf(known);
  std::vector<double> off;
  for (const double r : known) off.push_back(std::abs(r - median));
  const double spread = kNormalOfMad * statistics::MedianOf(off);
  // Of n days, without its bias, an estimate has about the variance (1 - r^2) n / (n - 4)^2. What
  // the estimates differ by beyond it, the cells do. A median has pi / 2 of a mean's variance.
  const double cells_known = static_cast<double>(known.size()), n = days_known / cells_known;
  const double noise = (1 - median * median) * n / ((n - 4) * (n - 4));
  const double variance = std::max(0.0, spread * spread - noise) + M_PI / 2 * noise / cells_known;
  const double bound = median + statistics::kNormal95 * std::sqrt(variance);
  for (double& r : own) r = std::min(std::max(r, bound), kMostAutocorrelation);
  return own;
}

std::vector<std::vector<DayValue>> MeansOfCells(const ReportData& data, int series) {
  std::vector<std::vector<DayValue>> means;
  for (const ReportedCell& cell : data.cells) means.push_back(Means(cell, data.period, series));
  return means;
}

/// What the tests could have shown among so many cells.
void AddDetectable(const ReportData& data, PlantReport& report) {
  const double tests = kSeries * static_cast<double>(report.drifts.size());
  const auto means = MeansOfCells(data, 0);
  const std::vector<double> correlated = Autocorrelations(means);
  std::vector<double> slopes;
  for (std::size_t k = 0; k < means.size(); ++k) {
    const auto trend = TrendOf(means[k], correlated[k], 1 - kSignificance / tests);
    if (!trend) continue;
    if (tests * trend->least_p > kSignificance) {
      ++report.never_significant;
    } else {
      slopes.push_back((trend->slope.high - trend->slope.low) / 2);
    }
  }
  if (!slopes.empty()) report.detectable_mm = statistics::MedianOf(slopes);
}

void AddDrifts(const ReportData& data, PlantReport& report) {
  std::vector<CellDrift> drifts(data.cells.size());
  std::vector<double> squares(data.cells.size());
  for (int series = 0; series < kSeries; ++series) {
    const auto means = MeansOfCells(data, series);
    const std::vector<double> correlated = Autocorrelations(means);
    for (std::size_t k = 0; k < drifts.size(); ++k) {
      CellDrift& drift = drifts[k];
      const auto trend = TrendOf(means[k], correlated[k]);
      if (!trend) continue;
      drift.cell = &data.cells[k];
      drift.p_adjusted = std::min(drift.p_adjusted, kSeries * trend->p);
      if (series == 0) {
        drift.size_mm = *trend;
      } else {
        squares[k] += trend->slope.value * trend->slope.value;
      }
      drift.moves_mm = std::sqrt(squares[k]);
    }
  }
  for (const CellDrift& drift : drifts) {
    if (drift.cell != nullptr) report.drifts.push_back(drift);
  }
  report.too_few_days = static_cast<int>(drifts.size() - report.drifts.size());
  AddDetectable(data, report);
  Adjust<CellDrift>(report.drifts, [](const CellDrift& drift) { return drift.moves_mm; });
  report.drift_groups =
      GroupAnswers(report.drifts, [](const CellDrift& drift) { return drift.size_mm.slope.value; });
}

/// Median of correlated days, with the interval widened as that of a mean would be.
std::optional<Interval> LevelOf(const std::vector<DayValue>& days, double correlated) {
  const auto level = MedianWithInterval(ValuesOf(days));
  if (!level) return std::nullopt;
  const double factor = std::sqrt((1 + correlated) / (1 - correlated)), value = level->median.value;
  return Interval{value, value - factor * (value - level->median.low),
                  value + factor * (level->median.high - value)};
}

void AddLevels(const ReportData& data, PlantReport& report) {
  const auto means = MeansOfCells(data, 0);
  const std::vector<double> correlated = Autocorrelations(means);
  for (std::size_t k = 0; k < means.size(); ++k) {
    const ReportedCell& cell = data.cells[k];
    const auto level = LevelOf(means[k], correlated[k]);
    if (!level) continue;
    CellLevel found{&cell, *level, correlated[k], 0, 0, 0};
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
  std::vector<std::vector<DayValue>> befores, afters, sides;
  for (const ReportedCell& cell : data.cells) {
    befores.push_back(Means(cell, period.first_day - period.compared_days, period.first_day - 1,
                            period.bin_days()));
    afters.push_back(Means(cell, period));
    sides.emplace_back();
    for (const DayValue& day : befores.back()) sides.back().push_back({day.day, day.value, 0});
    for (const DayValue& day : afters.back()) sides.back().push_back({day.day, day.value, 1});
  }
  const std::vector<double> correlated = Autocorrelations(sides);
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const auto shift = ShiftBetween(befores[k], afters[k], correlated[k]);
    if (!shift) {
      ++report.too_few_shift_days;
      continue;
    }
    report.shifts.push_back(
        {&data.cells[k], *shift, shift->p, befores[k].back().group != afters[k].back().group});
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

/// Both intervals at their least favourable ends, so a cautious one.
Interval Above(const Interval& level, const Interval& siblings) {
  return {level.value - siblings.value, level.low - siblings.high, level.high - siblings.low};
}

/// What restoring the cell's own earlier level would reduce, but not below its siblings' level: a
/// rise that leaves a cell better than they are is no reason to stop it.
/// @param days        of the present model
/// @param correlated  of their first and last third
std::optional<Maintenance> MaintenanceOf(const CellLevel& level, const std::vector<DayValue>& days,
                                         std::vector<double> earlier, double correlated,
                                         const PlantReport& report) {
  const std::size_t third = days.size() / kThirds;
  const double confidence = 1 - kSignificance / static_cast<double>(report.levels.size());
  const std::span<const DayValue> all(days);
  const auto siblings = SiblingsLevel(level, report);
  if (const auto rise = ShiftBetween(all.first(third), all.last(third), correlated, confidence);
      rise && rise->difference.low > 0) {
    Maintenance found{level.cell, rise->difference,
                      fmt::format("rose within the period, {} against {} days", third, third)};
    if (!siblings) return found;
    const auto present =
        LevelOf({days.end() - static_cast<std::ptrdiff_t>(third), days.end()}, correlated)
            .value_or(level.level_mm);
    const Interval above = Above(present, siblings->median);
    if (above.low <= 0) return std::nullopt;
    if (above.value < found.reduction_mm.value) {
      found.basis += "; down to its siblings' level only";
      found.reduction_mm = above;
    }
    return found;
  }
  if (!siblings) return std::nullopt;
  const auto present = LevelOf(days, level.autocorrelation);
  const double far = 2 * siblings->median.value;
  // A model that made the cell worse is to be replaced, not the cell to be repaired.
  if (!present || present->value < far) return std::nullopt;
  if (!earlier.empty() && statistics::MedianOf(earlier) < far) return std::nullopt;
  const Interval above = Above(*present, siblings->median);
  if (above.low <= 0) return std::nullopt;
  return Maintenance{level.cell, above, "over twice its siblings' level; no rise seen"};
}

void AddMaintenance(const ReportData& data, PlantReport& report) {
  std::vector<std::vector<DayValue>> present, ends;
  std::vector<std::vector<double>> earlier;
  for (const CellLevel& level : report.levels) {
    std::vector<DayValue> days = Means(*level.cell, data.period);
    const auto begin = std::find_if(days.begin(), days.end(), [&](const DayValue& day) {
      return day.group == days.back().group;
    });
    earlier.push_back(ValuesOf({days.begin(), begin}));
    days.erase(days.begin(), begin);
    // A step between the ends is no autocorrelation.
    const std::size_t third = days.size() / kThirds;
    ends.emplace_back();
    for (std::size_t k = 0; k < days.size(); ++k) {
      const bool last = k >= days.size() - third;
      if (k < third || last) ends.back().push_back({days[k].day, days[k].value, last});
    }
    present.push_back(std::move(days));
  }
  const std::vector<double> correlated = Autocorrelations(ends);
  for (std::size_t k = 0; k < present.size(); ++k) {
    if (auto found =
            MaintenanceOf(report.levels[k], present[k], earlier[k], correlated[k], report)) {
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
  AddDrifts(data, report);
  AddShifts(data, report);
  AddMaintenance(data, report);
  return report;
}

}  // namespace plumbline::plant
