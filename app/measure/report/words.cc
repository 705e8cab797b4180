#include "app/measure/report/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/measure/diagnosis/result/diagnosis_text.h"

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

/// "joint speed" for "qd", and for "qd1_deg_s" if it stands for the columns of all joints.
std::string AllJointsInWords(std::string_view name, bool of_all) {
  constexpr std::pair<std::string_view, const char*> kQuantities[] = {
      {"qd", "joint speed"}, {"qdd", "joint acceleration"}, {"tau", "joint torque"}};
  const std::string_view stem = name.substr(0, name.find_first_of("0123456789"));
  for (const auto& [quantity, words] : kQuantities) {
    if (stem == quantity && (of_all || stem == name)) return words;
  }
  return "";
}

/// True for a parameter of one joint, such as q3_amplitude.
bool IsOfJoint(std::string_view name) {
  return name.size() > 1 && name[0] == 'q' && name[1] >= '1' && name[1] <= '9';
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
    text.remove_prefix(name.size());
    const std::string all = AllJointsInWords(name, text.starts_with(".."));
    const bool recorded = std::ranges::any_of(
        diagnosis.signals, [name](const SignalTrace& signal) { return signal.name == name; });
    if (!all.empty()) {
      words += all;
      if (text.starts_with("..")) text.remove_prefix(2);
    } else if (recorded || IsStandardColumn(name)) {
      words += ColumnInWords(name);
    } else {
      words += IsOfJoint(name) ? ParameterInWords(name) : std::string(name);
    }
    if (text.empty()) break;
    words += text.front();
    text.remove_prefix(1);
  }
  return words;
}

std::string UtcInWords(const std::string& utc) {
  return utc.size() < 16 ? utc : utc.substr(0, 10) + " " + utc.substr(11, 5) + " UTC";
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
