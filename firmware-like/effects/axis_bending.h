// Bending of the extending beam of a prismatic axis.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The beam of a prismatic joint i, extended by x = |q_i| along its axis u, bends under the weight
/// beyond it, with force F and moment M at the carriage (origin of the joint's frame):
///   turn  value (F x^2 / 2 + M x)_perp         where F x is short for x u x F
///   shift value (F x^3 / 3 + M x^2 / 2)_perp   [Gere & Timoshenko, Mechanics of Materials, ch. 9]
/// value = 1 / (E I) [1/(N m^2)]. Everything beyond the carriage moves with it. Valid for rotations
/// of milliradians and a beam of constant section that is clamped where q_i = 0. Needs link masses.
const Effect& AxisBending();

}  // namespace plumbline::effects
