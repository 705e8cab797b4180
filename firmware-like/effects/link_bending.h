// Link bending: links that bend and twist under the weight outboard of them.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Link i is a cantilever of length L along e, from the axis of joint i to that of the next joint
/// (the last link: to the flange). M_root is the moment of the weight outboard of joint i about the
/// start of the link, M_tip that of the weight beyond the link about its end. Everything beyond the
/// link moves by:
///   bending q<i> = L / (E I):   turn  v (M_root + M_tip)_perp / 2
///                               shift v L (M_root / 3 + M_tip / 6) x e
///   torsion q<i>_torsion = L / (G J):   turn v (e . M_tip) e          both [rad/(N m)]
/// [Gere & Timoshenko, Mechanics of Materials, ch. 9; in calibration: Dumas et al. 2011, Robot.
/// Comput.-Integr. Manuf. 27(4)]. The moment is assumed to vary linearly along the link, which is
/// exact except for the link's own weight. Valid for rotations of milliradians and a link of equal
/// stiffness in both directions; adds nothing if L is zero. Needs link masses.
const Effect& LinkBending();

}  // namespace plumbline::effects
