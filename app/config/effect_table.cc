#include "app/config/effect_table.h"

#include <algorithm>
#include <charconv>

namespace plumbline {
namespace {

bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}

/// True where name fits the pattern, each `#` standing for one number without leading zero; the
/// first number must be in 1..joint_count.
bool Fits(std::string_view pattern, std::string_view name, int joint_count) {
  std::size_t at = 0;
  bool joint_seen = false;
  for (const char c : pattern) {
    if (c != '#') {
      if (at >= name.size() || name[at] != c) return false;
      ++at;
      continue;
    }
    int number = 0;
    const auto [end, error] = std::from_chars(name.data() + at, name.data() + name.size(), number);
    if (error != std::errc() || number < 1 || name[at] == '0') return false;
    if (!joint_seen && number > joint_count) return false;
    joint_seen = true;
    at = static_cast<std::size_t>(end - name.data());
    if (at < name.size() && IsDigit(name[at])) return false;
  }
  return at == name.size();
}

}  // namespace

const std::vector<EffectEntry>& EffectTable() {
  static const std::vector<EffectEntry> table = {
      {"base_frame",
       {{"x", "mm"}, {"y", "mm"}, {"z", "mm"}, {"roll", "deg"}, {"pitch", "deg"}, {"yaw", "deg"}}},
      {"tool_frame", {{"x", "mm"}, {"y", "mm"}, {"z", "mm"}}},
      {"joint_offset", {{"q#", "rad"}}},
      {"gear_ratio", {{"q#", "1"}}},
      {"link_geometry", {{"a#", "mm"}, {"d#", "mm"}, {"alpha#", "deg"}}},
      {"joint_compliance", {{"q#", "rad/(N m)"}}},
      {"joint_hardening", {{"q#", "rad/(N m)^3"}}},
      {"counterbalance", {{"q#_amplitude", "N m"}, {"q#_phase", "rad"}}},
      {"tool_stiffness", {{"ratio", "1"}}},
      {"tool_shear", {{"kappa", "1"}}},
      {"tool_root_compliance", {{"compliance", "rad/(N m)"}}},
      {"payload_mass", {{"scale", "1"}, {"constant", "kg"}}},
      {"payload_cog", {{"x", "mm"}, {"y", "mm"}, {"z", "mm"}}},
      {"gravity_direction", {{"x", "rad"}, {"y", "rad"}}},
      {"pedestal_compliance", {{"compliance", "rad/(N m)"}}},
      {"backlash", {{"q#", "rad"}, {"by", "", "load,move"}}},
      {"approach_lag", {{"q#", "1"}}},
      {"gear_periodic",
       {{"q#_amplitude", "rad"},
        {"q#_cycles", "1/turn"},
        {"q#_phase", "rad"},
        {"q#_#_amplitude", "rad"},
        {"q#_#_cycles", "1/turn"},
        {"q#_#_phase", "rad"}}},
      {"thermal_growth", {{"alpha", "1/K"}}},
      {"thermal_drift", {{"x", "mm"}, {"y", "mm"}, {"z", "mm"}, {"time_constant", "s"}}},
      {"latency", {{"time", "s"}}},
      {"dynamic_inertia", {{"q#", "s^2"}}},
      {"measurement_scale", {{"scale", "1"}}},
      {"step_event",
       {{"time", "s"},
        {"row", "1"},
        {"x", "mm"},
        {"y", "mm"},
        {"z", "mm"},
        {"frame", "", "base,tool"}}},
      {"empirical", {}},
  };
  return table;
}

const EffectEntry* FindEffect(std::string_view id) {
  const auto& table = EffectTable();
  const auto found = std::find_if(table.begin(), table.end(),
                                  [id](const EffectEntry& entry) { return entry.id == id; });
  return found == table.end() ? nullptr : &*found;
}

const EffectParameterEntry* FindParameter(const EffectEntry& effect, std::string_view name,
                                          int joint_count) {
  const auto found = std::find_if(effect.parameters.begin(), effect.parameters.end(),
                                  [&](const EffectParameterEntry& parameter) {
                                    return Fits(parameter.name, name, joint_count);
                                  });
  return found == effect.parameters.end() ? nullptr : &*found;
}

std::optional<int> JointFromScope(std::string_view scope, int joint_count) {
  if (!Fits("q#", scope, joint_count)) return std::nullopt;
  int joint = 0;
  std::from_chars(scope.data() + 1, scope.data() + scope.size(), joint);
  return joint;
}

}  // namespace plumbline
