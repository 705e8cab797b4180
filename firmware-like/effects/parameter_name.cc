#include "firmware-like/effects/parameter_name.h"

#include <charconv>

namespace plumbline::effects {
namespace {

/// Removes a number without leading zeros from the front of the text and returns it; 0 if there is
/// none.
int TakeNumber(std::string_view& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || number < 1 || text.front() == '0') return 0;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

/// Matches a name against a pattern in which each `#` stands for a number.
std::optional<TermParameter> Fit(std::string_view pattern, std::string_view name, int joint_count) {
  TermParameter parameter;
  char before = 0;
  for (const char c : pattern) {
    if (name.empty()) return std::nullopt;
    if (c != '#') {
      if (name.front() != c) return std::nullopt;
      name.remove_prefix(1);
      before = c;
      continue;
    }
    const int number = TakeNumber(name);
    if (number == 0) return std::nullopt;
    if (parameter.joint < 0) {
      if (number > joint_count) return std::nullopt;
      parameter.joint = number - 1;
    } else if (before == 'q') {
      if (number > parameter.joint) return std::nullopt;  // must be inboard of the first joint
      parameter.of = number - 1;
    } else if (before == 'k') {
      if (number <= parameter.joint || number > joint_count) return std::nullopt;
      parameter.of = number - 1;  // the joint's own link or one outboard of it
    } else {
      if (number < 2) return std::nullopt;
      parameter.harmonic = number;
    }
  }
  if (!name.empty()) return std::nullopt;
  return parameter;
}

}  // namespace

std::optional<TermParameter> ParameterFromName(const EffectTraits& traits, std::string_view name,
                                               int joint_count) {
  for (std::size_t spec = 0; spec < traits.parameters.size(); ++spec) {
    auto parameter = Fit(traits.parameters[spec].name, name, joint_count);
    if (!parameter) continue;
    parameter->spec = static_cast<int>(spec);
    return parameter;
  }
  return std::nullopt;
}

std::string NameFromParameter(const EffectTraits& traits, const TermParameter& parameter) {
  std::string name;
  bool joint_written = false;
  for (const char c : traits.parameters[parameter.spec].name) {
    if (c != '#') {
      name += c;
      continue;
    }
    const int second = parameter.of >= 0 ? parameter.of + 1 : parameter.harmonic;
    name += std::to_string(joint_written ? second : parameter.joint + 1);
    joint_written = true;
  }
  return name;
}

std::optional<int> JointFromScope(std::string_view scope, int joint_count) {
  const auto parameter = Fit("q#", scope, joint_count);
  if (!parameter) return std::nullopt;
  return parameter->joint;
}

std::vector<std::string_view> Choices(std::string_view words) {
  std::vector<std::string_view> choices;
  while (!words.empty()) {
    const auto comma = words.find(',');
    choices.push_back(words.substr(0, comma));
    words.remove_prefix(comma == std::string_view::npos ? words.size() : comma + 1);
  }
  return choices;
}

}  // namespace plumbline::effects
