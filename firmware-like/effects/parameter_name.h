// Parsing and formatting of parameter names in files: "q2", "q3_2_phase", "a2".
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Looks up a parameter or word by name; nullopt if the effect has no such parameter or the joint
/// is not in 1..joint_count. A second number is a term index starting at 2, a joint inboard of the
/// first ("q3_of_q2"), or the joint's own link or one outboard of it ("q2_link3_x").
std::optional<TermParameter> ParameterFromName(const EffectTraits& traits, std::string_view name,
                                               int joint_count);

/// The name of a parameter; inverse of ParameterFromName.
std::string NameFromParameter(const EffectTraits& traits, const TermParameter& parameter);

/// The 0-based joint of a scope entry ("q2" is 1); nullopt if it is not q1..q<joint_count>.
std::optional<int> JointFromScope(std::string_view scope, int joint_count);

/// Splits the choices of a word: "load,move" gives load and move.
std::vector<std::string_view> Choices(std::string_view words);

}  // namespace plumbline::effects
