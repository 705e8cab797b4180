#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kHottest_C = 200;      // no cell is hotter
constexpr double kShuffledFrom = 0.05;  // share of the steps in which t_s decreases
constexpr std::size_t kMinTimes = 4;
constexpr double kCodeTolerance = 1e-6;  // larger distances from the code are ordinary values
constexpr double kMinDistance_m =
    0.05;  // minimum distance of all other points if 0, 0, 0 is a code

bool LooksLikeCode(double value) {
  constexpr std::array<double, 11> kCodes = {999,   9999,  99999, 999999,     9999999,   99999999,
                                             32767, 32768, 65535, 2147483647, 2147483648};
  const double size = std::abs(value);
  return std::ranges::any_of(
      kCodes, [size](double code) { return std::abs(size - code) < kCodeTolerance; });
}

/// A column in the file's unit.
struct FileColumn {
  std::string name;
  std::function<double(const MeasuredRow&)> value;
};

std::vector<FileColumn> ColumnsOf(const MeasuredTable& table,
                                  const std::vector<model::Joint>& joints) {
  std::vector<FileColumn> columns;
  const RecordedColumns& recorded = table.recorded;
  for (int axis = 0; recorded.position && axis < 3; ++axis) {
    columns.push_back({std::string(1, "xyz"[axis]) + "_mm", [axis](const MeasuredRow& row) {
                         return row.measured_W ? (*row.measured_W)[axis] / kMetrePerMm
                                               : std::nan("");
                       }});
  }
  if (recorded.range) {
    columns.push_back({"range_mm", [](const MeasuredRow& row) {
                         return row.range_m ? *row.range_m / kMetrePerMm : std::nan("");
                       }});
  }
  if (recorded.time) columns.push_back({"t_s", [](const MeasuredRow& row) { return *row.t_s; }});
  if (recorded.temperature) {
    columns.push_back({"temp_C", [](const MeasuredRow& row) { return *row.temp_C; }});
  }
  if (recorded.payload) {
    columns.push_back({"payload_kg", [](const MeasuredRow& row) { return *row.payload_kg; }});
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::JointColumnForm& form = model::PositionForm(joints[i].type);
    columns.push_back({model::JointColumnName(form.quantity, form.type, static_cast<int>(i)),
                       [i, &form](const MeasuredRow& row) {
                         return row.q[static_cast<Eigen::Index>(i)] * form.from_SI;
                       }});
  }
  for (std::size_t i = 0; i < table.further.size(); ++i) {
    columns.push_back({table.further[i], [i](const MeasuredRow& row) { return row.further[i]; }});
  }
  return columns;
}

std::string LinesText(const std::vector<int>& lines) {
  constexpr std::size_t kMaxNamed = 8;
  const std::vector<int> first(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                  kMaxNamed, lines.size())));
  return fmt::format("line{} {}{}", lines.size() == 1 ? "" : "s", fmt::join(first, ", "),
                     lines.size() > kMaxNamed ? ", .." : "");
}

std::optional<std::string> CodeIn(const MeasuredTable& table, const FileColumn& column) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  std::map<double, std::vector<int>> codes;
  for (const MeasuredRow& row : table.rows) {
    const double value = column.value(row);
    if (!std::isfinite(value)) continue;
    if (LooksLikeCode(value)) {
      codes[std::round(value)].push_back(row.line);
    } else {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  if (low > high) return std::nullopt;
  const double span = high - low;
  for (const auto& [code, lines] : codes) {
    const double beyond = std::max(low - code, code - high);
    if (!(beyond > span) || 2 * lines.size() > table.rows.size()) continue;
    return fmt::format(
        "{} is {:.0f} in {} rows ({}), while all others lie between {:.6g} and {:.6g}: that is a "
        "code for \"nothing measured\", not a value. Leave such cells empty: the row then keeps "
        "its place in the order of moves",
        column.name, code, lines.size(), LinesText(lines), low, high);
  }
  return std::nullopt;
}

std::optional<std::string> PointsAtOrigin(const MeasuredTable& table) {
  if (!table.recorded.position) return std::nullopt;
  std::vector<int> lines;
  double nearest_m = HUGE_VAL;
  for (const MeasuredRow& row : table.rows) {
    if (!row.measured_W) continue;
    const double distance_m = row.measured_W->norm();
    if (distance_m == 0) {
      lines.push_back(row.line);
    } else {
      nearest_m = std::min(nearest_m, distance_m);
    }
  }
  const bool some = !lines.empty() && lines.size() < table.rows.size();
  if (!some || nearest_m < kMinDistance_m) return std::nullopt;
  return fmt::format(
      "x_mm, y_mm, z_mm are 0, 0, 0 in {} rows ({}), while no other point is within {:.0f} mm of "
      "the origin: nothing was measured there. Leave those cells empty: the row then keeps its "
      "place in the order of moves",
      lines.size(), LinesText(lines), 1e3 * nearest_m);
}

/// Range of some numbers.
struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL;
  void Add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Describes which rows are hot: all (empty text), those from or up to a line, or single lines.
std::string HotRowsText(const std::vector<MeasuredRow>& rows, const std::vector<int>& hot) {
  const std::size_t cold = rows.size() - hot.size();
  if (cold == 0) return "";
  if (hot.front() == rows[cold].line) return fmt::format(" from line {} on", hot.front());
  if (hot.back() == rows[hot.size() - 1].line) return fmt::format(" up to line {}", hot.back());
  return fmt::format(" in {} rows ({})", hot.size(), LinesText(hot));
}

std::optional<std::string> Kelvin(const MeasuredTable& table) {
  if (!table.recorded.temperature) return std::nullopt;
  constexpr double kFreezing_K = 273.15;
  std::vector<int> hot;
  Range of_hot, of_others;
  for (const MeasuredRow& row : table.rows) {
    const bool is_hot = row.temp_C >= kHottest_C;
    (is_hot ? of_hot : of_others).Add(*row.temp_C);
    if (is_hot) hot.push_back(row.line);
  }
  if (hot.empty()) return std::nullopt;
  const std::string others = hot.size() == table.rows.size()
                                 ? ""
                                 : fmt::format(", and between {:.6g} and {:.6g} in the others",
                                               of_others.low, of_others.high);
  return fmt::format(
      "temp_C lies between {:.6g} and {:.6g}{}{}: no cell is that hot; as kelvin it is "
      "{:.4g}..{:.4g} deg C. Subtract 273.15",
      of_hot.low, of_hot.high, HotRowsText(table.rows, hot), others, of_hot.low - kFreezing_K,
      of_hot.high - kFreezing_K);
}

/// Steps between successive rows of a session, and those in which t_s decreases.
struct ClockSteps {
  std::size_t steps = 0;
  std::vector<int> lines;  ///< the line after each decrease
};

ClockSteps ClockStepsOf(const MeasuredTable& table) {
  std::map<std::string, double> last_s;
  std::vector<double> rises_s;
  std::vector<std::pair<int, double>> decreases;
  ClockSteps clock;
  for (const MeasuredRow& row : table.rows) {
    const auto [before, is_first] = last_s.emplace(row.session, *row.t_s);
    if (is_first) continue;
    const double step_s = *row.t_s - before->second;
    ++clock.steps;
    if (step_s > 0) rises_s.push_back(step_s);
    if (step_s < 0) decreases.emplace_back(row.line, -step_s);
    before->second = *row.t_s;
  }
  // A clock adjusted by less than the usual interval does not change the order.
  const double usual_s = rises_s.empty() ? 0 : statistics::MedianOf(rises_s);
  for (const auto& [line, by_s] : decreases) {
    if (by_s > usual_s) clock.lines.push_back(line);
  }
  return clock;
}

std::optional<std::string> ShuffledRows(const MeasuredTable& table) {
  if (!table.recorded.time || !table.recorded.order) return std::nullopt;
  const ClockSteps clock = ClockStepsOf(table);
  const auto decreases = static_cast<double>(clock.lines.size());
  if (clock.lines.size() < 3 || decreases < kShuffledFrom * static_cast<double>(clock.steps)) {
    return std::nullopt;
  }
  return fmt::format(
      "t_s decreases in {} of {} steps from row to row ({}): the rows are not in the order in "
      "which they were measured, on which effects of time and of the last move depend. Sort them "
      "by t_s; if the clock is wrong, omit t_s; if several runs are mixed, give each its own "
      "session",
      clock.lines.size(), clock.steps, LinesText(clock.lines));
}

}  // namespace

std::optional<std::string> ImpossibleValues(const MeasuredTable& table,
                                            const std::vector<model::Joint>& joints) {
  if (table.rows.size() < kMinTimes) return std::nullopt;
  for (const FileColumn& column : ColumnsOf(table, joints)) {
    if (const auto code = CodeIn(table, column)) return code;
  }
  if (const auto origin = PointsAtOrigin(table)) return origin;
  if (const auto kelvin = Kelvin(table)) return kelvin;
  return ShuffledRows(table);
}

void DiscardRestartedClock(MeasuredTable& table) {
  if (!table.recorded.time) return;
  const ClockSteps clock = ClockStepsOf(table);
  if (clock.lines.empty()) return;
  table.recorded.time = false;
  table.recorded.clock_restarted = true;
  for (std::vector<MeasuredRow>* rows : {&table.rows, &table.unmeasured}) {
    for (MeasuredRow& row : *rows) row.t_s.reset();
  }
  table.notes.push_back(
      fmt::format("t_s decreases {} times ({}): the clock was restarted, so times before and after "
                  "are not comparable. Effects of time are not considered; give the rows after "
                  "each restart their own session, or continue the count of t_s",
                  clock.lines.size(), LinesText(clock.lines)));
}

}  // namespace plumbline::measure
