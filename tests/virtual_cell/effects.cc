#include "tests/virtual_cell/effects.h"

#include <fmt/core.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

namespace virtual_cell {
namespace {

/// Keys of an effect; "q#" stands for q1, q2, ..
struct Entry {
  const char* id;
  std::vector<std::string> keys;
};

const std::vector<Entry>& Catalogue() {
  static const std::vector<Entry> entries = {
      {"base_frame", {"x", "y", "z", "roll", "pitch", "yaw"}},
      {"tool_frame", {"x", "y", "z"}},
      {"joint_offset", {"q#"}},
      {"gear_ratio", {"q#"}},
      {"joint_compliance", {"q#"}},
      {"joint_hardening", {"q#"}},
      {"counterbalance", {"q2_amplitude", "q2_phase"}},
      {"tool_stiffness", {"ratio"}},
      {"tool_shear", {"kappa"}},
      {"tool_root_compliance", {"compliance"}},
      {"payload_mass", {"scale", "constant"}},
      {"payload_cog", {"x", "y", "z"}},
      {"gravity_direction", {"x", "y"}},
      {"pedestal_compliance", {"compliance"}},
      {"backlash", {"q#", "by"}},
      {"approach_lag", {"q#"}},
      {"gear_periodic", {"q#_amplitude", "q#_cycles", "q#_phase"}},
      {"thermal_growth", {"alpha"}},
      {"thermal_drift", {"x", "y", "z", "time_constant"}},
      {"creep", {"amplitude", "time_constant"}},
      {"step_event", {"time", "x", "y", "z"}},
  };
  return entries;
}

bool Matches(const std::string& pattern, const std::string& key) {
  const std::size_t hash = pattern.find('#');
  if (hash == std::string::npos) return pattern == key;
  std::size_t digits = hash;
  while (digits < key.size() && key[digits] >= '0' && key[digits] <= '9') ++digits;
  return digits > hash && key.compare(0, hash, pattern, 0, hash) == 0 &&
         key.substr(digits) == pattern.substr(hash + 1);
}

double NumberFromText(const std::string& text, const std::string& where) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size()) {
    throw std::runtime_error(fmt::format("effect {}: '{}' is not a number", where, text));
  }
  return value;
}

}  // namespace

Effect EffectFromText(const std::string& text) {
  const std::size_t colon = text.find(':');
  Effect effect;
  effect.id = text.substr(0, colon);
  const auto& catalogue = Catalogue();
  const auto entry = std::find_if(catalogue.begin(), catalogue.end(),
                                  [&](const Entry& e) { return effect.id == e.id; });
  if (entry == catalogue.end()) {
    throw std::runtime_error(fmt::format("effect '{}' is unknown; available effects:\n{}",
                                         effect.id, EffectCatalogue()));
  }
  if (colon == std::string::npos) {
    throw std::runtime_error(fmt::format("effect {} needs key=value after a colon", effect.id));
  }
  std::istringstream parts(text.substr(colon + 1));
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t equals = part.find('=');
    const std::string key = part.substr(0, equals);
    const bool known = std::any_of(entry->keys.begin(), entry->keys.end(),
                                   [&](const std::string& k) { return Matches(k, key); });
    if (!known || equals == std::string::npos) {
      throw std::runtime_error(fmt::format("effect {}: '{}' is not one of its keys:\n{}", effect.id,
                                           part, EffectCatalogue()));
    }
    const std::string value = part.substr(equals + 1);
    if (key == "by") {
      if (value != "move" && value != "load") {
        throw std::runtime_error(
            fmt::format("effect {}: by={} is neither move nor load", effect.id, value));
      }
      effect.by_move = value == "move";
    } else {
      effect.values[key] = NumberFromText(value, effect.id + " " + key);
    }
  }
  return effect;
}

std::vector<Effect> EffectsFromTexts(const std::vector<std::string>& texts) {
  std::vector<Effect> effects;
  effects.reserve(texts.size());
  for (const std::string& text : texts) effects.push_back(EffectFromText(text));
  return effects;
}

const Effect* Effects::Find(const std::string& id) const {
  const auto found =
      std::find_if(list_.begin(), list_.end(), [&](const Effect& e) { return e.id == id; });
  return found == list_.end() ? nullptr : &*found;
}

bool Effects::ByMove(const std::string& id) const {
  const Effect* effect = Find(id);
  return effect != nullptr && effect->by_move;
}

double Effects::Value(const std::string& id, const std::string& key, double otherwise) const {
  const Effect* effect = Find(id);
  if (effect == nullptr) return otherwise;
  const auto found = effect->values.find(key);
  return found == effect->values.end() ? otherwise : found->second;
}

double Effects::OfJoint(const std::string& id, int index, const std::string& suffix) const {
  return list_.empty() ? 0.0 : Value(id, fmt::format("q{}{}", index + 1, suffix));
}

std::string EffectCatalogue() {
  std::string text;
  for (const Entry& entry : Catalogue()) {
    text += fmt::format("  {}:", entry.id);
    for (const std::string& key : entry.keys) text += " " + key;
    text += "\n";
  }
  return text;
}

}  // namespace virtual_cell
