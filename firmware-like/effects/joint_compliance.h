// Joint compliance: a joint that winds up under its gravity torque more or less than declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// s_i += value_i tau_i, with tau_i the gravity torque about the joint, or the measured one if the
/// arm has torque sensors   [formats.md; Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit:
/// rad/(N m). For a prismatic joint m/N, with tau_i the weight along its axis: a spindle or belt
/// that stretches, 0.1 to 1000 N/um. Valid for a linear gearbox; see joint_hardening. The plausible
/// range includes negative values, for a declared compliance that is somewhat too large; the sum
/// with the declared one must stay positive.
const Effect& JointCompliance();

}  // namespace plumbline::effects
