// Something that slipped, was hit or was exchanged at one moment.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// From the moment on, t_s >= time or row >= row (the first row being 1), something stands (x, y,
/// z) farther: the base in W (frame = base) or the tip in F (frame = tool). Units of the files: s,
/// 1, mm. Without a moment, or where its signal is unknown, nothing. The moment has no derivative:
/// search it.
const Effect& StepEvent();

}  // namespace plumbline
