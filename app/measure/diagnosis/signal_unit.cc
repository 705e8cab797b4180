#include "app/measure/diagnosis/signal_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

namespace plumbline::measure {
namespace {

constexpr std::pair<std::string_view, std::string_view> kOfTwoParts[] = {
    {"_deg_s2", "deg/s^2"}, {"_deg_s", "deg/s"}, {"_mm_s2", "mm/s^2"}, {"_mm_s", "mm/s"}};
constexpr std::pair<std::string_view, std::string_view> kOfOnePart[] = {
    {"_s", "s"},   {"_deg", "deg"}, {"_rad", "rad"}, {"_mm", "mm"},   {"_m", "m"},
    {"_kg", "kg"}, {"_bar", "bar"}, {"_N", "N"},     {"_Nm", "N m"},  {"_A", "A"},
    {"_V", "V"},   {"_W", "W"},     {"_Hz", "Hz"},   {"_rpm", "rpm"}, {"_C", "\u00b0C"}};

}  // namespace

std::string UnitOfSignal(std::string_view column) {
  for (const auto& [ending, unit] : kOfTwoParts) {
    if (column.ends_with(ending)) return std::string(unit);
  }
  const std::size_t at = column.rfind('_');
  if (at == std::string_view::npos) return fmt::format("unit of {}", column);
  const std::string_view unit = column.substr(at + 1);
  return unit == "C" ? "K" : std::string(unit);
}

std::string SignalLabel(std::string_view column) {
  std::string_view unit, ending;
  for (const auto& [of_ending, of_unit] : kOfOnePart) {
    if (column.ends_with(of_ending)) std::tie(ending, unit) = std::tie(of_ending, of_unit);
  }
  for (const auto& [of_ending, of_unit] : kOfTwoParts) {
    if (column.ends_with(of_ending)) std::tie(ending, unit) = std::tie(of_ending, of_unit);
  }
  if (ending.empty() || ending.size() == column.size()) return std::string(column);
  std::string name(column.substr(0, column.size() - ending.size()));
  if (name == "t") name = "time";
  if (name == "temp") name = "temperature";
  std::replace(name.begin(), name.end(), '_', ' ');
  return fmt::format("{} ({})", name, unit);
}

}  // namespace plumbline::measure
