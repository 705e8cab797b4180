#include "app/programs/brands/fanuc_positions.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "app/programs/brands/fanuc_words.h"

namespace plumbline::programs::fanuc {
namespace {

/// What a point states for one group.
struct Group {
  long number = 1;
  std::array<std::optional<Number>, 6> pose;
  std::vector<std::optional<Number>> joints;
  std::vector<std::optional<Number>> extended;  ///< E1, E2 ..
  std::optional<Configuration::Field> configuration;
  std::optional<long> frame, tool;
  bool untaught = false;
  bool remote_tool = false;

  bool IsPose() const {
    return std::ranges::any_of(pose, [](const auto& n) { return n.has_value(); });
  }
};

std::optional<long> WholeNumber(std::string_view digits) {
  long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size())
    return std::nullopt;
  return value;
}

/// Place of "X", "W" .. in a pose; RX .. are those of a remote tool.
std::optional<std::size_t> PoseIndex(std::string_view key) {
  constexpr std::string_view kNames = "XYZWPR";
  if (key.size() == 2 && key[0] == 'R') key.remove_prefix(1);
  const std::size_t index = key.size() == 1 ? kNames.find(key[0]) : std::string_view::npos;
  return index == std::string_view::npos ? std::nullopt : std::optional(index);
}

/// Sets a component of joints or external axes, counted from 1.
void SetAxis(std::vector<std::optional<Number>>& axes, std::string_view digits, const Number& n) {
  const auto number = WholeNumber(digits);
  if (!number || *number < 1 || *number > 12) return;
  if (axes.size() < static_cast<std::size_t>(*number)) axes.resize(*number);
  axes[static_cast<std::size_t>(*number) - 1] = n;
}

/// `'N U T, 0, 0, 0'`: the text between the quotes.
std::optional<Configuration::Field> TakeQuoted(SourceCursor& at) {
  if (!at.Take('\'')) return std::nullopt;
  const std::size_t begin = at.at();
  while (!at.AtEnd() && at.Peek() != '\'' && !IsLineEnd(at.Peek())) at.Skip();
  Configuration::Field field{"CONFIG", at.SpanFrom(begin), std::string(at.TextFrom(begin))};
  at.Take('\'');
  return field;
}

/// One `KEY : value` or `KEY = value`; false if there is none.
bool TakeEntry(SourceCursor& at, Group& group) {
  const std::string_view key = EnglishWord(at.TakeWord());
  if (key.empty()) return false;
  at.SkipBlanks();
  if (!at.Take(':') && !at.Take('=')) return false;
  at.SkipBlanks();
  if (key == "CONFIG") {
    group.configuration = TakeQuoted(at);
    return true;
  }
  if (at.Peek() == '*') {
    while (at.Take('*') || at.Take('.')) {
    }
    group.untaught = true;
    at.SkipBlanks();
    at.TakeWord();
    return true;
  }
  const std::size_t begin = at.at();
  const auto number = at.TakeNumber();
  if (!number) return !at.TakeWord().empty();  // UF : F
  if (key == "UF" || key == "UT") {
    (key == "UF" ? group.frame : group.tool) = WholeNumber(at.TextFrom(begin));
    return true;
  }
  if (const auto index = PoseIndex(key)) {
    group.pose[*index] = number;
    group.remote_tool |= key.size() == 2;
  } else if (key[0] == 'J') {
    SetAxis(group.joints, key.substr(1), *number);
  } else if (key[0] == 'E') {
    SetAxis(group.extended, key.substr(1), *number);
  }
  at.SkipBlanks();
  at.TakeWord();  // mm, deg
  return true;
}

/// The groups between the braces of a point.
std::vector<Group> TakeGroups(SourceCursor& at) {
  std::vector<Group> groups;
  while (!at.AtEnd() && at.Peek() != '}') {
    at.SkipSpace();
    if (at.Take(',') || at.Take(';') || at.AtEnd() || at.Peek() == '}') continue;
    if (StartsWithWord(at.Rest(), "GP") && IsDigit(at.Peek(2))) {
      const std::string_view word = at.TakeWord();
      groups.emplace_back().number = WholeNumber(word.substr(2)).value_or(0);
      at.Take(':');
      continue;
    }
    Group without_number;
    if (!TakeEntry(at, groups.empty() ? without_number : groups.back())) at.Skip();
  }
  at.Take('}');
  return groups;
}

Point PointOf(std::string name, Place place, const Group& group) {
  Point point;
  point.name = std::move(name);
  point.place = place;
  if (group.IsPose()) {
    point.numbers.assign(group.pose.begin(), group.pose.end());
  } else {
    point.kind = PointKind::kJoints;
    point.numbers = group.joints;
  }
  if (group.configuration && !group.configuration->text.empty()) {
    point.configuration.fields.push_back(*group.configuration);
  }
  for (const auto& axis : group.extended) {
    if (axis) point.external_axes.push_back(axis);
  }
  if (group.tool) point.stated_tool = ToolKey(*group.tool);
  if (group.frame) point.stated_base = BaseKey(*group.frame);
  if (group.untaught) {
    point.untouchable = "not taught (********)";
  } else if (group.remote_tool) {
    point.untouchable = "taught for a tool that stands in the cell (remote TCP: RX, RY, RZ)";
  } else if (!group.tool || !group.frame) {
    point.untouchable = "states no number of a tool or frame (UT, UF)";
  }
  return point;
}

/// `P[n` and its label, up to the bracket.
std::optional<long> TakePointNumber(SourceCursor& at) {
  if (!at.TakeKeyword("P") || !at.Take('[')) return std::nullopt;
  const std::size_t begin = at.at();
  while (IsDigit(at.Peek())) at.Skip();
  const auto number = WholeNumber(at.TextFrom(begin));
  bool quoted = false;
  while (!at.AtEnd() && !IsLineEnd(at.Peek()) && (quoted || at.Peek() != ']')) {
    if (at.Peek() == '"') quoted = !quoted;
    at.Skip();
  }
  return at.Take(']') ? number : std::nullopt;
}

}  // namespace

PointNumbers ReadPositions(SourceCursor section, const LineIndex& lines, Program& program) {
  PointNumbers numbers;
  SourceCursor& at = section;
  while (!at.AtEnd()) {
    at.SkipSpace();
    const std::size_t begin = at.at();
    const auto number = TakePointNumber(at);
    at.SkipSpace();
    if (!number || !at.Take('{')) {
      if (at.at() == begin) at.Skip();
      continue;
    }
    const Place place{at.SpanFrom(begin).file, lines.LineAt(begin)};
    const std::string name = fmt::format("P[{}]", *number);
    const std::vector<Group> groups = TakeGroups(at);
    const auto robot = std::ranges::find(groups, 1L, &Group::number);
    const Group& own = robot != groups.end() ? *robot : groups.empty() ? Group{} : groups.front();
    const std::size_t index = program.points.size();
    Point point = PointOf(name, place, own);
    if (robot == groups.end()) point.untouchable = "has no position of the robot (group 1)";
    if (!numbers.emplace(*number, index).second)
      point.untouchable = name + " is written twice in this file";
    program.points.push_back(std::move(point));
    for (const Group& group : groups) {
      if (group.number == own.number) continue;
      if (!group.IsPose()) {
        for (const auto& axis : group.joints) {
          if (axis) program.points[index].external_axes.push_back(axis);
        }
        continue;
      }
      Point other = PointOf(fmt::format("{} GP{}", name, group.number), place, group);
      if (other.untouchable.empty())
        other.untouchable = fmt::format("belongs to another arm (group {})", group.number);
      program.points.push_back(std::move(other));
    }
  }
  return numbers;
}

}  // namespace plumbline::programs::fanuc
