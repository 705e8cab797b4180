// Joints that yield to their gravity torque more, or less, than declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// s_i += value_i tau_i, tau_i the gravity torque about the joint, or the measured one where the
/// arm has torque sensors   [formats.md; Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit:
/// rad/(N m); of a prismatic joint m/N, tau_i the weight along its axis: a spindle or a belt that
/// stretches, 0.1 to 1000 N/um. Valid while the gearbox is linear; see joint_hardening. The range
/// lets a declared compliance be somewhat too large; the sum with the declared one must stay
/// positive.
const Effect& JointCompliance();

}  // namespace plumbline
