#include "app/measure/table/gaps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMinSteps = 8;  // to accept a row counter or a regular clock
constexpr double kRegularClock =
    0.15;                          // largest scatter of its intervals, relative to their median
constexpr double kLostFrom = 1.6;  // median intervals: 1 + four times that scatter
constexpr double kToStandardDeviation =
    1.4826;  // from the median absolute deviation, for a normal distribution

bool Unreadable(const MeasuredTable& table, const MeasuredRow& row) {
  return std::binary_search(table.unreadable_lines.begin(), table.unreadable_lines.end(), row.line);
}

/// Two consecutive readable rows of one session.
struct Step {
  std::size_t from = 0, to = 0;  ///< row indices
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

/// Whether a column is a row counter.
bool IsRowCounter(const std::vector<MeasuredRow>& rows, const std::vector<Step>& steps,
                  std::size_t c) {
  if (steps.size() < kMinSteps) return false;
  std::size_t by_one = 0;
  for (const Step& step : steps) {
    const double from = rows[step.from].further[c], to = rows[step.to].further[c];
    if (from != std::round(from) || to != std::round(to) || to <= from) return false;
    by_one += to - from == static_cast<double>(step.to - step.from) ? 1U : 0U;
  }
  return 2 * by_one >= steps.size();
}

/// Marks the move between the rows of a step as unknown.
void AddBreak(const std::vector<MeasuredRow>& rows, const Step& step, MeasuredTable& table) {
  for (std::size_t k = step.from + 1; k <= step.to; ++k) table.breaks.push_back(rows[k].line);
}

void NoteLost(std::size_t places, int first_line, const std::string& by, MeasuredTable& table) {
  if (places == 0) return;
  table.notes.push_back(fmt::format(
      "lines are missing in {} places (first: before line {}), as {} shows: the robot's "
      "last move before those rows is unknown",
      places, first_line, by));
}

void FindByCounter(std::vector<MeasuredRow>& rows, const std::vector<Step>& steps,
                   MeasuredTable& table) {
  for (std::size_t c = table.further.size(); c-- > 0;) {
    if (!IsRowCounter(rows, steps, c)) continue;
    std::size_t places = 0;
    int first_line = 0;
    for (const Step& step : steps) {
      const double counted = rows[step.to].further[c] - rows[step.from].further[c];
      if (counted <= static_cast<double>(step.to - step.from)) continue;
      AddBreak(rows, step, table);
      if (places++ == 0) first_line = rows[step.to].line;
    }
    NoteLost(places, first_line, "the row count in column " + table.further[c], table);
    DropFurther(c, rows, table);
  }
}

/// Time between the rows of a step; nullopt if one of them has none.
std::optional<double> IntervalOf(const std::vector<MeasuredRow>& rows, const Step& step) {
  const std::optional<double>&from_s = rows[step.from].t_s, &to_s = rows[step.to].t_s;
  return from_s && to_s ? std::optional(*to_s - *from_s) : std::nullopt;
}

void FindByClock(const std::vector<MeasuredRow>& rows, const std::vector<Step>& steps,
                 MeasuredTable& table) {
  std::vector<double> intervals_s;
  for (const Step& step : steps) {
    if (step.to != step.from + 1) continue;
    const std::optional<double> interval_s = IntervalOf(rows, step);
    // Rows with equal times are copies and say nothing about the clock's interval.
    if (interval_s && *interval_s > 0) intervals_s.push_back(*interval_s);
  }
  if (intervals_s.size() < kMinSteps) return;
  const double usual_s = statistics::MedianOf(intervals_s);
  for (double& interval_s : intervals_s) interval_s = std::abs(interval_s - usual_s);
  if (kToStandardDeviation * statistics::MedianOf(intervals_s) > kRegularClock * usual_s) return;
  std::size_t places = 0;
  int first_line = 0;
  for (const Step& step : steps) {
    const double most_s = usual_s * (static_cast<double>(step.to - step.from) + kLostFrom - 1);
    if (!(IntervalOf(rows, step).value_or(0) > most_s)) continue;
    AddBreak(rows, step, table);
    if (places++ == 0) first_line = rows[step.to].line;
  }
  NoteLost(places, first_line, fmt::format("t_s with its interval of {:.3g} s", usual_s), table);
}

/// A column with at most one value in each row.
struct ScalarColumn {
  std::function<std::optional<double>(const MeasuredRow&)> value;
  std::function<void(MeasuredRow&, std::optional<double>)> set;
};

ScalarColumn ColumnOf(std::optional<double> MeasuredRow::*value) {
  return {[value](const MeasuredRow& row) { return row.*value; },
          [value](MeasuredRow& row, std::optional<double> to) { row.*value = to; }};
}

/// An additional column; an empty cell is NaN.
ScalarColumn FurtherColumn(std::size_t c) {
  return {[c](const MeasuredRow& row) {
            const double value = row.further[c];
            return std::isnan(value) ? std::nullopt : std::optional(value);
          },
          [c](MeasuredRow& row, std::optional<double> to) {
            row.further[c] = to.value_or(std::nan(""));
          }};
}

/// Readable rows whose cell is empty.
std::vector<std::size_t> EmptyRows(const std::vector<MeasuredRow>& rows, const MeasuredTable& table,
                                   const ScalarColumn& column) {
  std::vector<std::size_t> empty;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!Unreadable(table, rows[k]) && !column.value(rows[k])) empty.push_back(k);
  }
  return empty;
}

/// The nearest rows of the same session before and after that have a value.
struct Neighbours {
  std::optional<std::size_t> before, after;
};

/// The neighbours of every row, in one sweep in each direction.
std::vector<Neighbours> NeighboursOf(const std::vector<MeasuredRow>& rows,
                                     const MeasuredTable& table, const ScalarColumn& column) {
  std::vector<Neighbours> found(rows.size());
  std::map<std::string, std::size_t> last, next;
  const auto has_value = [&](std::size_t k) {
    return !Unreadable(table, rows[k]) && column.value(rows[k]).has_value();
  };
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto before = last.find(rows[k].session);
    if (before != last.end()) found[k].before = before->second;
    if (has_value(k)) last[rows[k].session] = k;
  }
  for (std::size_t k = rows.size(); k-- > 0;) {
    const auto after = next.find(rows[k].session);
    if (after != next.end()) found[k].after = after->second;
    if (has_value(k)) next[rows[k].session] = k;
  }
  return found;
}

/// The value of an empty cell that has at least one neighbour.
double Interpolated(const std::vector<MeasuredRow>& rows, const Neighbours& neighbours,
                    std::size_t k, const ScalarColumn& column, bool over_time) {
  if (!neighbours.before || !neighbours.after)
    return *column.value(rows[neighbours.before ? *neighbours.before : *neighbours.after]);
  const auto place = [&](std::size_t j) {
    return over_time ? *rows[j].t_s : static_cast<double>(j);
  };
  const double length = place(*neighbours.after) - place(*neighbours.before);
  const double share =
      length > 0 ? std::clamp((place(k) - place(*neighbours.before)) / length, 0.0, 1.0) : 0.5;
  return std::lerp(*column.value(rows[*neighbours.before]), *column.value(rows[*neighbours.after]),
                   share);
}

void Warn(MeasuredTable& table, config::FaultList& faults, int line, const std::string& column,
          const std::string& what) {
  faults.Add({config::Fault::Severity::kWarning, table.file, line, column, what});
  table.notes.push_back(fmt::format("{} {}", column, what));
}

/// Interpolates the empty cells of a slowly varying signal.
/// @return  false if the column has too few values, or none in some session: it then counts as not
///          recorded, and all its cells are empty
bool FillSlow(std::vector<MeasuredRow>& rows, MeasuredTable& table, config::FaultList& faults,
              const std::string& name, const ScalarColumn& column, bool over_time) {
  const std::vector<std::size_t> empty = EmptyRows(rows, table, column);
  if (empty.empty()) return true;
  const std::vector<Neighbours> neighbours = NeighboursOf(rows, table, column);
  std::vector<double> values;
  for (const std::size_t k : empty) {
    const Neighbours& nearest = neighbours[k];
    if (nearest.before || nearest.after)
      values.push_back(Interpolated(rows, nearest, k, column, over_time));
  }
  const int line = rows[empty.front()].line;
  if (values.size() < empty.size() || 2 * empty.size() > rows.size()) {
    for (MeasuredRow& row : rows) column.set(row, std::nullopt);
    Warn(table, faults, line, name,
         fmt::format("is empty in {} of {} rows (first: line {}): too few to interpolate; the "
                     "column is not used",
                     empty.size(), rows.size(), line));
    return false;
  }
  for (std::size_t j = 0; j < empty.size(); ++j) column.set(rows[empty[j]], values[j]);
  Warn(table, faults, line, name,
       fmt::format("is empty in {} rows (first: line {}): interpolated from adjacent rows",
                   empty.size(), line));
  return true;
}

void FillPayload(std::vector<MeasuredRow>& rows, MeasuredTable& table, config::FaultList& faults) {
  const ScalarColumn column = ColumnOf(&MeasuredRow::payload_kg);
  const std::vector<std::size_t> empty = EmptyRows(rows, table, column);
  if (empty.empty()) return;
  const std::vector<Neighbours> neighbours = NeighboursOf(rows, table, column);
  std::vector<std::optional<double>> carried;
  std::size_t unknown = 0;
  for (const std::size_t k : empty) {
    const Neighbours& nearest = neighbours[k];
    const bool agree = nearest.before && nearest.after &&
                       rows[*nearest.before].payload_kg == rows[*nearest.after].payload_kg;
    carried.push_back(agree ? rows[*nearest.before].payload_kg : std::nullopt);
    unknown += agree ? 0U : 1U;
  }
  for (std::size_t j = 0; j < empty.size(); ++j) {
    MeasuredRow& row = rows[empty[j]];
    row.payload_kg = carried[j];
    if (!carried[j]) DiscardMeasurement(row);
  }
  const int line = rows[empty.front()].line;
  Warn(table, faults, line, "payload_kg",
       fmt::format("is empty in {} rows (first: line {}): {} were filled from adjacent rows, which "
                   "agree; {} are between different payloads and count only in the order of "
                   "moves",
                   empty.size(), line, empty.size() - unknown, unknown));
}

/// Discards incomplete joint vectors.
/// @param essential  whether a row without the vector loses its measurement, too
void FillJoints(std::vector<MeasuredRow>& rows, MeasuredTable& table, config::FaultList& faults,
                const char* column, model::JointVector MeasuredRow::*vector, bool essential) {
  std::size_t count = 0;
  int line = 0;
  for (MeasuredRow& row : rows) {
    if (Unreadable(table, row) || !(row.*vector).hasNaN()) continue;
    (row.*vector).resize(0);
    if (essential) DiscardMeasurement(row);
    if (count++ == 0) line = row.line;
  }
  if (count == 0) return;
  Warn(table, faults, line, column,
       fmt::format("has empty cells in {} rows (first: line {}): {}", count, line,
                   essential ? "those rows count only in the order of moves"
                             : "not recorded in those rows"));
}

}  // namespace

void DiscardMeasurement(MeasuredRow& row) {
  row.measured_W.reset();
  row.range_m.reset();
  row.orientation_W.reset();
  row.gauge_m.reset();
  row.artefact.clear();
}

void DropFurther(std::size_t column, std::vector<MeasuredRow>& rows, MeasuredTable& table) {
  const auto at = static_cast<std::ptrdiff_t>(column);
  table.further.erase(table.further.begin() + at);
  for (MeasuredRow& row : rows) row.further.erase(row.further.begin() + at);
}

void FindLostLines(std::vector<MeasuredRow>& rows, MeasuredTable& table) {
  const std::vector<Step> steps = StepsOf(rows, table);
  FindByCounter(rows, steps, table);
  if (table.recorded.time) FindByClock(rows, steps, table);
  std::ranges::sort(table.breaks);
  table.breaks.erase(std::unique(table.breaks.begin(), table.breaks.end()), table.breaks.end());
}

void FillEmptyCells(std::vector<MeasuredRow>& rows, MeasuredTable& table,
                    config::FaultList& faults) {
  RecordedColumns& recorded = table.recorded;
  if (recorded.time) {
    recorded.time = FillSlow(rows, table, faults, "t_s", ColumnOf(&MeasuredRow::t_s), false);
  }
  const bool timed = recorded.time;
  if (recorded.temperature) {
    recorded.temperature =
        FillSlow(rows, table, faults, "temp_C", ColumnOf(&MeasuredRow::temp_C), timed);
  }
  for (std::size_t c = table.further.size(); c-- > 0;) {
    if (!FillSlow(rows, table, faults, table.further[c], FurtherColumn(c), timed)) {
      DropFurther(c, rows, table);
    }
  }
  if (recorded.payload) FillPayload(rows, table, faults);
  if (recorded.qd) FillJoints(rows, table, faults, "qd", &MeasuredRow::qd, false);
  if (recorded.qdd) FillJoints(rows, table, faults, "qdd", &MeasuredRow::qdd, false);
  if (recorded.tau) FillJoints(rows, table, faults, "tau", &MeasuredRow::tau, true);
  if (recorded.q_step) {
    double largest = 0;
    for (const MeasuredRow& row : rows) {
      largest = std::max(largest, row.q_step_rad.value_or(0));
    }
    for (MeasuredRow& row : rows) {
      if (!row.q_step_rad) row.q_step_rad = largest;
    }
  }
}

}  // namespace plumbline::measure
