// Step event: something that slipped, was hit or was exchanged at one time.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// From the event on (t_s >= time, or row >= row with the first row being 1), the base in W (frame
/// = base) or the tip in F (frame = tool) is displaced by (x, y, z). File units: s, 1, mm. Adds
/// nothing if no event time is given or its signal is unknown. The event time has no derivative and
/// must be searched.
const Effect& StepEvent();

}  // namespace plumbline::effects
