#include "app/measure/report/words.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/measure/diagnosis/diagnosis_text.h"

namespace plumbline::measure {
namespace {

bool IsOfName(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

/// True for the columns that a table may have besides those of further signals.
bool IsStandardColumn(std::string_view column) {
  if (column == "t_s" || column == "temp_C" || column == "payload_kg") return true;
  const std::string words = ColumnInWords(column);
  return words != column && words.find("joint ") != std::string::npos &&
         words.find_last_of("0123456789") + 1 == words.size();
}

}  // namespace

std::string ColumnInWords(std::string_view column) {
  const std::string label = SignalLabel(column);
  return label.substr(0, label.rfind(" ("));
}

std::string InWords(std::string_view text, const Diagnosis& diagnosis) {
  std::string words;
  while (!text.empty()) {
    const auto end = std::ranges::find_if_not(text, &IsOfName);
    const std::string_view name = text.substr(0, static_cast<std::size_t>(end - text.begin()));
    const bool recorded = std::ranges::any_of(
        diagnosis.signals, [name](const SignalTrace& signal) { return signal.name == name; });
    const bool column = recorded || IsStandardColumn(name);
    words += column ? ColumnInWords(name) : std::string(name);
    text.remove_prefix(name.size());
    if (column && text.starts_with("..")) {  // "qd1_deg_s..": the columns of all joints
      words += ", \u2026";
      text.remove_prefix(2);
    } else if (!text.empty()) {
      words += text.front();
      text.remove_prefix(1);
    }
  }
  return words;
}

std::string ParameterInWords(std::string_view parameter) {
  std::string words;
  bool numbered = false;
  while (!parameter.empty()) {
    const std::string_view part = parameter.substr(0, parameter.find('_'));
    parameter.remove_prefix(std::min(parameter.size(), part.size() + 1));
    const std::size_t digits = std::min(part.find_first_of("0123456789"), part.size());
    const std::string_view stem = part.substr(0, digits), number = part.substr(digits);
    if (!words.empty()) words += numbered && part != "of" ? ", " : " ";
    numbered = !number.empty();
    if (!numbered) {
      words += stem;
    } else if (stem == "q") {
      words += fmt::format("joint {}", number);
    } else if (stem.empty() || stem == "link") {
      words += fmt::format("{} {}", stem.empty() ? "line" : stem, number);
    } else {
      words += fmt::format("{} of axis {}", stem, number);
    }
  }
  return words;
}

}  // namespace plumbline::measure
