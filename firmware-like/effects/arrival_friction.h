// Arrival friction: load-dependent friction that stops a joint short of its command.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Coulomb friction in a loaded gear grows with the load, mu |tau|, and opposes the motion of the
/// arriving joint. It winds up the drive train until the controller considers the target reached:
///   s_i -= value_i u_i |tau_i|,   u_i = dq_i / max_j |dq_j|          [rad/(N m)]
/// with dq the last move and tau the gravity torque. The value is approximately the friction
/// coefficient times the compliance. Valid under the same conditions as `following_error`; this is
/// its load-dependent part.
const Effect& ArrivalFriction();

}  // namespace plumbline::effects
