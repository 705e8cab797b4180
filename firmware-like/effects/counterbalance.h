// Counterbalance: a balancing spring that the model lacks.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// tau_i += amplitude sin(q_i + phase), a torque that moves the arm only through that joint's
/// compliance, declared or fitted. Units: N m, rad. An absent phase is 0. Cannot be separated from
/// gear_periodic with one cycle per turn [formats.md]. Valid for a spring or gas cylinder whose
/// lever is short compared with its length.
const Effect& Counterbalance();

}  // namespace plumbline::effects
