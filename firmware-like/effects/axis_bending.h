// Prismatic axes whose extending beam bends under its load.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The beam of a prismatic joint i, extended by x = |q_i| along its axis u, bends under the weight
/// beyond it, F its force and M its moment at the carriage (the origin of the joint's frame):
///   turn  value (F x^2 / 2 + M x)_perp         with F x standing for x u x F
///   shift value (F x^3 / 3 + M x^2 / 2)_perp   [Gere & Timoshenko, Mechanics of Materials, ch. 9]
/// value = 1 / (E I) [1/(N m^2)]. Everything beyond the carriage follows. Valid for milliradians, a
/// beam clamped where q_i = 0 and of one section. Needs link masses.
const Effect& AxisBending();

}  // namespace plumbline
