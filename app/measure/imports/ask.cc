#include "app/measure/imports/ask.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <istream>
#include <ostream>

namespace plumbline::measure {
namespace {

constexpr int kAttempts = 3;

/// First values of a column, for the question.
std::string ExampleText(const text::DelimitedText& layout, std::size_t column) {
  std::string text;
  for (std::size_t row = 0; row < layout.records.size() && row < 3; ++row) {
    const auto& fields = layout.records[row].fields;
    if (column < fields.size()) text += (text.empty() ? "" : ", ") + fields[column].substr(0, 20);
  }
  return text;
}

/// Asks until `allowed` accepts the answer; nullopt at the end of the input or after kAttempts.
std::optional<std::string> Ask(std::istream& in, std::ostream& out, const std::string& question,
                               const std::function<bool(const std::string&)>& allowed,
                               const std::string& help) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    out << question << std::flush;
    std::string answer;
    if (!std::getline(in, answer)) return std::nullopt;
    while (!answer.empty() && (answer.back() == '\r' || answer.back() == ' ')) answer.pop_back();
    if (allowed(answer)) return answer;
    out << "  " << help << '\n';
  }
  return std::nullopt;
}

}  // namespace

Mapping MappingOf(const UnderstoodFile& file) {
  Mapping mapping;
  mapping.layout = {file.layout.separator, file.layout.decimal, file.layout.header_line};
  for (std::size_t i = 0; i < file.meanings.size(); ++i) {
    MappedColumn column{file.layout.names[i], 0, file.meanings[i].target, file.meanings[i].unit};
    const auto& names = file.layout.names;
    if (column.from.empty() || std::ranges::count(names, column.from) > 1) {
      column.from.clear();
      column.number = static_cast<int>(i) + 1;
    }
    if (column.to.empty()) column.unit.clear();
    mapping.columns.push_back(std::move(column));
  }
  return mapping;
}

std::optional<Mapping> AskMapping(const UnderstoodFile& file, std::istream& in, std::ostream& out) {
  Mapping mapping = MappingOf(file);
  for (std::size_t i = 0; i < mapping.columns.size(); ++i) {
    MappedColumn& column = mapping.columns[i];
    const std::string name =
        fmt::format("column {} {} ({})", i + 1, file.layout.names[i], ExampleText(file.layout, i));
    if (column.to.empty()) {
      const auto answer = Ask(
          in, out, fmt::format("{}: which quantity? [ignore] ", name),
          [](const std::string& text) { return text.empty() || KindOfTarget(text).has_value(); },
          "one of q1_deg .., x_mm, y_mm, z_mm, range_mm, gauge_mm, qw, qx, qy, qz, t_s, temp_C, "
          "payload_kg, sigma_mm, u95_mm, session, artefact, camera, tool, payload_item, number, "
          "name, "
          "delete; or nothing");
      if (!answer) return std::nullopt;
      column.to = *answer;
    }
    const auto kind = KindOfTarget(column.to);
    if (!kind || ScaleOf(*kind, column.unit)) continue;
    const auto unit = Ask(
        in, out, fmt::format("{}: unit of {}? ", name, column.to),
        [&](const std::string& text) { return ScaleOf(*kind, text).has_value(); },
        "one of " + UnitsOf(*kind));
    if (!unit) return std::nullopt;
    column.unit = *unit;
  }
  return mapping;
}

}  // namespace plumbline::measure
