// A joint that has not quite arrived when it is measured.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i -= value_i (last move of joint i)   [formats.md]. Unit: 1, the part of the move that is
/// still to come. Valid where the wait after each move is the same.
const Effect& ApproachLag();

}  // namespace plumbline
