// Every effect that the model knows.
#pragma once

#include <span>
#include <string_view>

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The physical effects, in the order of the file formats' table; a line here makes an effect known
/// to configuration, compensation, diagnosis and report. The order is also that of summation.
std::span<const Effect* const> Catalogue();

/// The effect of an id, of the catalogue or "empirical"; null where there is none.
const Effect* FindEffect(std::string_view id);

}  // namespace plumbline
