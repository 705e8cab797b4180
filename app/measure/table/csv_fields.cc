#include "app/measure/table/csv_fields.h"

#include <fmt/format.h>

#include <algorithm>

namespace plumbline::measure {

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string Shown(std::string_view field) {
  std::string shown(field.substr(0, 40));
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7F) c = '?';
  }
  return fmt::format("\"{}{}\"", shown, field.size() > 40 ? "..." : "");
}

std::string ShownName(std::string_view name) {
  const std::string shown = Shown(name);
  return shown.substr(1, shown.size() - 2);
}

std::string_view TakeUntil(char separator, std::string_view& rest) {
  const auto end = rest.find(separator);
  const std::string_view taken = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return taken;
}

void SplitFields(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  const auto count = std::ranges::count(line, ',') + 1;
  for (std::ptrdiff_t i = 0; i < count; ++i) fields.push_back(Trimmed(TakeUntil(',', line)));
}

}  // namespace plumbline::measure
