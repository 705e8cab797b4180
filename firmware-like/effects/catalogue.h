// Catalogue of all physical effects.
#pragma once

#include <span>
#include <string_view>

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// All physical effects, in the order of summation, which is also that of docs/effects.md.
/// Configuration, compensation, diagnosis and report all use this list.
std::span<const Effect* const> Catalogue();

/// Looks up an effect by id, in the catalogue or "empirical"; null if there is none.
const Effect* FindEffect(std::string_view id);

}  // namespace plumbline::effects
