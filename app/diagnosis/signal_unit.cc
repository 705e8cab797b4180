#include "app/diagnosis/signal_unit.h"

#include <fmt/format.h>

#include <utility>

namespace plumbline::diagnosis {

std::string UnitOfSignal(std::string_view column) {
  constexpr std::pair<std::string_view, std::string_view> kOfTwoParts[] = {
      {"_deg_s2", "deg/s^2"}, {"_deg_s", "deg/s"}, {"_mm_s2", "mm/s^2"}, {"_mm_s", "mm/s"}};
  for (const auto& [ending, unit] : kOfTwoParts) {
    if (column.ends_with(ending)) return std::string(unit);
  }
  const std::size_t at = column.rfind('_');
  if (at == std::string_view::npos) return fmt::format("unit of {}", column);
  const std::string_view unit = column.substr(at + 1);
  return unit == "C" ? "K" : std::string(unit);
}

}  // namespace plumbline::diagnosis
