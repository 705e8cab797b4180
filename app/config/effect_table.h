// The effects that a cell file may carry: their ids, parameters and units, in one table.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace plumbline {

/// A parameter as the file formats fix it. In `name`, `#` stands for a number; the first one is
/// that of a joint. `words` lists what a parameter that is a word may say, comma-separated.
struct EffectParameterEntry {
  std::string_view name;
  std::string_view unit;
  std::string_view words{};
};

struct EffectEntry {
  std::string_view id;
  std::vector<EffectParameterEntry> parameters;  ///< empty for "empirical": any
};

/// Every effect of the file formats, in their order, and "empirical" last.
const std::vector<EffectEntry>& EffectTable();

/// The entry of an id; null where there is none.
const EffectEntry* FindEffect(std::string_view id);

/// The entry of a parameter by its name in a file ("q2", "q3_2_phase"); null where the effect has
/// no such parameter or the joint is not one of 1..joint_count.
const EffectParameterEntry* FindParameter(const EffectEntry& effect, std::string_view name,
                                          int joint_count);

/// The joint of a scope entry ("q2" is 2); nothing where it is not one of q1..q<joint_count>.
std::optional<int> JointFromScope(std::string_view scope, int joint_count);

}  // namespace plumbline
