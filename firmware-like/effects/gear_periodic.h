// Gearing and encoder errors that come back every part of a turn.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i += sum over terms of amplitude sin(cycles q_i + phase), q_i in rad as commanded   [Whitney,
/// Lozinski & Rourke 1986, J. Dyn. Syst. Meas. Control 108(1); strain-wave gears: Tuttle 1992, MIT
/// AI-TR 1365]. Units: rad, 1/turn, rad. Any number of cycles, whole or not; an absent one is 1, an
/// absent phase 0. The first term is q1_amplitude.., the next q1_2_amplitude.. Equals
/// counterbalance at one cycle.
const Effect& GearPeriodic();

}  // namespace plumbline
