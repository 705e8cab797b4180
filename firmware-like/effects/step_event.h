// Step event: sudden displacement of the base or the tip after a slip, a collision or an exchange.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// From the event onwards (t_s >= time, or row number >= row, counted from 1), the base in W (frame
/// = base) or the tip in F (frame = tool) is displaced by (x, y, z). File units: s, 1, mm. Adds
/// nothing if no event time is given or its signal is unknown. The event time has no derivative and
/// must be found by search.
const Effect& StepEvent();

}  // namespace plumbline::effects
