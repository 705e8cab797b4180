#include "app/table/gaps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

constexpr std::size_t kFewestSteps = 8;  // of a counter or a clock that lost lines are told by
constexpr double kRegularClock = 0.15;   // scatter of its intervals over their median
constexpr double kLostFrom = 1.6;        // of the median interval: four times that scatter
constexpr double kToStandardDeviation = 1.4826;  // of a normal's median absolute deviation

bool Unreadable(const MeasuredTable& table, const MeasuredRow& row) {
  return std::binary_search(table.unreadable_lines.begin(), table.unreadable_lines.end(), row.line);
}

/// Two readable rows of one session, with only unreadable ones between.
struct Step {
  std::size_t from = 0, to = 0;  ///< rows
};

std::vector<Step> StepsOf(const std::vector<MeasuredRow>& rows, const MeasuredTable& table) {
  std::map<std::string, std::size_t> last;
  std::vector<Step> steps;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (Unreadable(table, rows[k])) continue;
    const auto [before, fresh] = last.emplace(rows[k].session, k);
    if (fresh) continue;
    steps.push_back({before->second, k});
    before->second = k;
  }
  return steps;
}

/// True where a column counts the rows.
bool Counts(const std::vector<MeasuredRow>& rows, const std::vector<Step>& steps, std::size_t c) {
  if (steps.size() < kFewestSteps) return false;
  std::size_t by_one = 0;
  for (const Step& step : steps) {
    const double from = rows[step.from].further[c], to = rows[step.to].further[c];
    if (from != std::round(from) || to != std::round(to) || to <= from) return false;
    by_one += to - from == static_cast<double>(step.to - step.from) ? 1U : 0U;
  }
  return 2 * by_one >= steps.size();
}

/// The way between the rows of a step is not known.
void Break(const std::vector<MeasuredRow>& rows, const Step& step, MeasuredTable& table) {
  for (std::size_t k = step.from + 1; k <= step.to; ++k) table.breaks.push_back(rows[k].line);
}

void NoteLost(std::size_t places, int first_line, const std::string& by, MeasuredTable& table) {
  if (places == 0) return;
  table.notes.push_back(fmt::format(
      "lines are missing in {} places (first: before line {}), as {} shows: the robot's "
      "last move before the rows there is not known",
      places, first_line, by));
}

void FindByCounter(std::vector<MeasuredRow>& rows, const std::vector<Step>& steps,
                   MeasuredTable& table) {
  for (std::size_t c = table.further.size(); c-- > 0;) {
    if (!Counts(rows, steps, c)) continue;
    std::size_t places = 0;
    int first_line = 0;
    for (const Step& step : steps) {
      const double counted = rows[step.to].further[c] - rows[step.from].further[c];
      if (counted <= static_cast<double>(step.to - step.from)) continue;
      Break(rows, step, table);
      if (places++ == 0) first_line = rows[step.to].line;
    }
    NoteLost(places, first_line, "the row count in column " + table.further[c], table);
    DropFurther(c, rows, table);
  }
}

void FindByClock(const std::vector<MeasuredRow>& rows, const std::vector<Step>& steps,
                 MeasuredTable& table) {
  std::vector<double> intervals_s;
  for (const Step& step : steps) {
    if (step.to != step.from + 1) continue;
    const double interval_s = rows[step.to].t_s - rows[step.from].t_s;
    // Rows at one time are repeats or copies; what the clock's interval is they do not show.
    if (std::isfinite(interval_s) && interval_s > 0) intervals_s.push_back(interval_s);
  }
  if (intervals_s.size() < kFewestSteps) return;
  const double usual_s = MedianOf(intervals_s);
  for (double& interval_s : intervals_s) interval_s = std::abs(interval_s - usual_s);
  if (kToStandardDeviation * MedianOf(intervals_s) > kRegularClock * usual_s) return;
  std::size_t places = 0;
  int first_line = 0;
  for (const Step& step : steps) {
    const double most_s = usual_s * (static_cast<double>(step.to - step.from) + kLostFrom - 1);
    if (!(rows[step.to].t_s - rows[step.from].t_s > most_s)) continue;
    Break(rows, step, table);
    if (places++ == 0) first_line = rows[step.to].line;
  }
  NoteLost(places, first_line, fmt::format("t_s with its interval of {:.3g} s", usual_s), table);
}

using Cell = std::function<double&(MeasuredRow&)>;

/// Rows whose cell is empty, of those that can be read.
std::vector<std::size_t> EmptyRows(std::vector<MeasuredRow>& rows, const MeasuredTable& table,
                                   const Cell& cell) {
  std::vector<std::size_t> empty;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!Unreadable(table, rows[k]) && std::isnan(cell(rows[k]))) empty.push_back(k);
  }
  return empty;
}

/// The nearest rows on either side that hold the cell, of the same session.
struct Neighbours {
  std::optional<std::size_t> before, after;
};

/// Of every row, in one sweep each way.
std::vector<Neighbours> NeighboursOf(std::vector<MeasuredRow>& rows, const MeasuredTable& table,
                                     const Cell& cell) {
  std::vector<Neighbours> found(rows.size());
  std::map<std::string, std::size_t> last, next;
  const auto holds = [&](std::size_t k) {
    return !Unreadable(table, rows[k]) && !std::isnan(cell(rows[k]));
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto before = last.find(rows[k].session);
    if (before != last.end()) found[k].before = before->second;
    if (holds(k)) last[rows[k].session] = k;
  }
  for (std::size_t k = rows.size(); k-- > 0;) {
    const auto after = next.find(rows[k].session);
    if (after != next.end()) found[k].after = after->second;
    if (holds(k)) next[rows[k].session] = k;
  }
  return found;
}

double Interpolated(std::vector<MeasuredRow>& rows, const Neighbours& of, std::size_t k,
                    const Cell& cell, bool over_time) {
  if (!of.before || !of.after) return cell(rows[of.before.value_or(of.after.value_or(k))]);
  const auto place = [&](std::size_t j) {
    return over_time ? rows[j].t_s : static_cast<double>(j);
  };
  const double length = place(*of.after) - place(*of.before);
  const double share =
      length > 0 ? std::clamp((place(k) - place(*of.before)) / length, 0.0, 1.0) : 0.5;
  return std::lerp(cell(rows[*of.before]), cell(rows[*of.after]), share);
}

void Warn(MeasuredTable& table, FaultList& faults, int line, const std::string& column,
          const std::string& what) {
  faults.Add({Fault::Severity::kWarning, table.file, line, column, what});
  table.notes.push_back(fmt::format("{} {}", column, what));
}

/// Interpolates an empty cell of a slow signal.
/// @return  false where the column holds too little, or nothing in some session: then all its
///          cells are zero, and it is not recorded
bool FillSlow(std::vector<MeasuredRow>& rows, MeasuredTable& table, FaultList& faults,
              const std::string& column, const Cell& cell, bool over_time) {
  const std::vector<std::size_t> empty = EmptyRows(rows, table, cell);
  if (empty.empty()) return true;
  const std::vector<Neighbours> neighbours = NeighboursOf(rows, table, cell);
  std::vector<double> values;
  for (const std::size_t k : empty) {
    const Neighbours& of = neighbours[k];
    if (of.before || of.after) values.push_back(Interpolated(rows, of, k, cell, over_time));
  }
  const int line = rows[empty.front()].line;
  if (values.size() < empty.size() || 2 * empty.size() > rows.size()) {
    for (MeasuredRow& row : rows) cell(row) = 0;
    Warn(table, faults, line, column,
         fmt::format("is empty in {} of {} rows (first: line {}): too few to interpolate; the "
                     "column is not used",
                     empty.size(), rows.size(), line));
    return false;
  }
  for (std::size_t j = 0; j < empty.size(); ++j) cell(rows[empty[j]]) = values[j];
  Warn(table, faults, line, column,
       fmt::format("is empty in {} rows (first: line {}): interpolated between the rows around",
                   empty.size(), line));
  return true;
}

void WithoutMeasurement(MeasuredRow& row) {
  row.has_point = row.has_range = row.has_orientation = false;
}

void FillPayload(std::vector<MeasuredRow>& rows, MeasuredTable& table, FaultList& faults) {
  const Cell cell = [](MeasuredRow& row) -> double& { return row.payload_kg; };
  const std::vector<std::size_t> empty = EmptyRows(rows, table, cell);
  if (empty.empty()) return;
  const std::vector<Neighbours> neighbours = NeighboursOf(rows, table, cell);
  std::vector<std::optional<double>> carried;
  std::size_t unknown = 0;
  for (const std::size_t k : empty) {
    const Neighbours& of = neighbours[k];
    const bool agree =
        of.before && of.after && rows[*of.before].payload_kg == rows[*of.after].payload_kg;
    carried.push_back(agree ? std::optional(rows[*of.before].payload_kg) : std::nullopt);
    unknown += agree ? 0U : 1U;
  }
  for (std::size_t j = 0; j < empty.size(); ++j) {
    MeasuredRow& row = rows[empty[j]];
    row.payload_kg = carried[j].value_or(0);
    if (!carried[j]) WithoutMeasurement(row);
  }
  const int line = rows[empty.front()].line;
  Warn(table, faults, line, "payload_kg",
       fmt::format("is empty in {} rows (first: line {}): in {} taken from the rows around, which "
                   "agree; {} stand between different payloads, take no part and keep their place "
                   "in the order of moves",
                   empty.size(), line, empty.size() - unknown, unknown));
}

/// Rows that lack a value of a joint vector lack it whole.
/// @param essential  without it the row's measurement cannot be used
void FillJoints(std::vector<MeasuredRow>& rows, MeasuredTable& table, FaultList& faults,
                const char* column, JointVector MeasuredRow::*vector, bool essential) {
  std::size_t count = 0;
  int line = 0;
  for (MeasuredRow& row : rows) {
    if (Unreadable(table, row) || !(row.*vector).hasNaN()) continue;
    (row.*vector).resize(0);
    if (essential) WithoutMeasurement(row);
    if (count++ == 0) line = row.line;
  }
  if (count == 0) return;
  Warn(table, faults, line, column,
       fmt::format("has empty cells in {} rows (first: line {}): {}", count, line,
                   essential ? "those rows take no part and keep their place in the order of moves"
                             : "not recorded in those rows"));
}

}  // namespace

void DropFurther(std::size_t column, std::vector<MeasuredRow>& rows, MeasuredTable& table) {
  const auto at = static_cast<std::ptrdiff_t>(column);
  table.further.erase(table.further.begin() + at);
  for (MeasuredRow& row : rows) row.further.erase(row.further.begin() + at);
}

void FindLostLines(std::vector<MeasuredRow>& rows, MeasuredTable& table) {
  const std::vector<Step> steps = StepsOf(rows, table);
  FindByCounter(rows, steps, table);
  if (table.recorded.time) FindByClock(rows, steps, table);
  std::sort(table.breaks.begin(), table.breaks.end());
  table.breaks.erase(std::unique(table.breaks.begin(), table.breaks.end()), table.breaks.end());
}

void FillEmptyCells(std::vector<MeasuredRow>& rows, MeasuredTable& table, FaultList& faults) {
  RecordedColumns& recorded = table.recorded;
  if (recorded.time) {
    const Cell cell = [](MeasuredRow& row) -> double& { return row.t_s; };
    recorded.time = FillSlow(rows, table, faults, "t_s", cell, false);
  }
  const bool timed = recorded.time;
  if (recorded.temperature) {
    const Cell cell = [](MeasuredRow& row) -> double& { return row.temp_C; };
    recorded.temperature = FillSlow(rows, table, faults, "temp_C", cell, timed);
  }
  for (std::size_t c = table.further.size(); c-- > 0;) {
    const Cell cell = [c](MeasuredRow& row) -> double& { return row.further[c]; };
    if (!FillSlow(rows, table, faults, table.further[c], cell, timed)) DropFurther(c, rows, table);
  }
  if (recorded.payload) FillPayload(rows, table, faults);
  if (recorded.qd) FillJoints(rows, table, faults, "qd", &MeasuredRow::qd, false);
  if (recorded.qdd) FillJoints(rows, table, faults, "qdd", &MeasuredRow::qdd, false);
  if (recorded.tau) FillJoints(rows, table, faults, "tau", &MeasuredRow::tau, true);
  if (recorded.q_step) {
    double largest = 0;
    for (const MeasuredRow& row : rows) {
      if (row.q_step_rad > largest) largest = row.q_step_rad;
    }
    for (MeasuredRow& row : rows) {
      if (std::isnan(row.q_step_rad)) row.q_step_rad = largest;
    }
  }
}

}  // namespace plumbline
