// A joint that stops short of its command by what friction under load holds.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// Friction of a loaded gear grows with the load (Coulomb: mu |tau|) and opposes the motion with
/// which the joint arrives; the drive train winds up by it until the controller calls the point
/// reached:
///   s_i -= value_i u_i |tau_i|,   u_i = dq_i / max_j |dq_j|          [rad/(N m)]
/// with dq the last move and tau the gravity torque. The value is about friction coefficient times
/// compliance. Valid as `following_error`, of which it is the part that follows the load.
const Effect& ArrivalFriction();

}  // namespace plumbline
