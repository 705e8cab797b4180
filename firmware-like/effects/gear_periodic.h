// Periodic gear error: transmission and encoder errors that repeat with the joint angle.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i += sum over terms of amplitude sin(cycles q_i + phase), with the commanded q_i in rad
/// [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst. Meas. Control 108(1); strain-wave gears: Tuttle
/// 1992, MIT AI-TR 1365]. Units: rad, 1/turn, rad. The number of cycles need not be an integer; the
/// default is 1 cycle and phase 0. The parameters of the first term are named q1_amplitude etc.,
/// those of the second q1_2_amplitude etc. Equivalent to counterbalance at one cycle.
const Effect& GearPeriodic();

}  // namespace plumbline::effects
