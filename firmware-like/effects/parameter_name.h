// The names that parameters have in the files: "q2", "q3_2_phase", "a2".
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The parameter of that name; nothing where the effect has no such parameter, or the joint is not
/// one of 1..joint_count. A second number counts terms of one joint, from 2, or is a joint inwards
/// of the first ("q3_of_q2"), or a link from the joint's own outwards ("q2_link3_x"). Words are
/// found, too.
std::optional<TermParameter> ParameterFromName(const EffectTraits& traits, std::string_view name,
                                               int joint_count);

/// The reverse.
std::string NameFromParameter(const EffectTraits& traits, const TermParameter& parameter);

/// The joint of a scope entry, 0-based ("q2" is 1); nothing where it is not q1..q<joint_count>.
std::optional<int> JointFromScope(std::string_view scope, int joint_count);

/// The choices of a word: "load,move" gives load and move.
std::vector<std::string_view> Choices(std::string_view words);

}  // namespace plumbline
