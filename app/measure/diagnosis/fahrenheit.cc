#include "app/measure/diagnosis/fahrenheit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace plumbline::measure {
namespace {

// Read as Fahrenheit, 55 to 120 is 13 to 49 deg C, the range of a working cell.
constexpr model::Interval kLikely{55, 120};
constexpr std::size_t kMinTemperatures = 4;  // fewer are single wrong rows instead of another unit

double CelsiusFrom(double fahrenheit) {
  return (fahrenheit - 32) / 1.8;
}

/// The temperatures from kLikely.low on, ascending; empty if they are few, if some of them are hot
/// in degrees Fahrenheit too, or if the others lead up to them as in a warm-up.
std::vector<double> LikelyFahrenheit(const MeasuredTable& table) {
  constexpr double kMinGap = 10;
  std::vector<double> temperatures;
  if (!table.recorded.temperature) return temperatures;
  double coldest = kLikely.high, hottest_of_others = -HUGE_VAL;
  for (const MeasuredRow& row : table.rows) {
    const double temp_C = *row.temp_C;
    if (temp_C >= kLikely.low) {
      temperatures.push_back(temp_C);
      coldest = std::min(coldest, temp_C);
    } else {
      hottest_of_others = std::max(hottest_of_others, temp_C);
    }
  }
  if (coldest - hottest_of_others < kMinGap) return {};
  std::ranges::sort(temperatures);
  if (temperatures.size() < kMinTemperatures || temperatures.back() > kLikely.high) return {};
  return temperatures;
}

std::string RowsText(const MeasuredTable& table, std::size_t likely) {
  if (likely == table.rows.size()) return "";
  const auto first = std::ranges::find_if(
      table.rows, [](const MeasuredRow& row) { return row.temp_C >= kLikely.low; });
  return fmt::format(" in {} of {} rows (first: line {})", likely, table.rows.size(), first->line);
}

}  // namespace

void NoteLikelyFahrenheit(MeasuredTable& table) {
  const std::vector<double> likely = LikelyFahrenheit(table);
  if (likely.empty()) return;
  table.notes.push_back(fmt::format(
      "temp_C is {:.3g} to {:.3g}{}, which is hot for a cell; if these are degrees Fahrenheit "
      "({:.3g} to {:.3g} deg C), convert them",
      likely.front(), likely.back(), RowsText(table, likely.size()), CelsiusFrom(likely.front()),
      CelsiusFrom(likely.back())));
}

std::optional<Mistake> FahrenheitMistake(const Dataset& data) {
  const std::size_t likely = LikelyFahrenheit(data.table).size();
  if (likely == 0) return std::nullopt;
  const bool all = likely == data.table.rows.size();
  Mistake mistake{"temp_C holds degrees Fahrenheit" + RowsText(data.table, likely),
                  all ? "write degrees Celsius; if it is in degrees Celsius, correct "
                        "reference_temperature_C, which has the same effect"
                      : "write degrees Celsius in every row",
                  [](Dataset& changed) {
                    for (const RowIndex row : changed.row_indices()) {
                      double& temp_C = *changed.table.rows[row.offset()].temp_C;
                      if (temp_C < kLikely.low) continue;
                      temp_C = CelsiusFrom(temp_C);
                      changed.conditions[row].temp_C = temp_C;
                    }
                  }};
  mistake.subtle = true;
  mistake.affects = [](const MeasuredRow& row) { return row.temp_C >= kLikely.low; };
  return mistake;
}

}  // namespace plumbline::measure
