// Tool shear: a short tool that deforms by shear as well as by bending.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The tip moves by F L / (kappa G A) across the tool, with F the transverse force of the payload
/// [Gere & Timoshenko, Mechanics of Materials; kappa: Cowper 1966, J. Appl. Mech. 33(2)]. Unit: 1.
/// Add() receives the linear quantity 1/kappa, which is 0 if shear is neglected. kappa is 0.85 for
/// a solid rectangle, 0.44 for a thin square tube. Relevant below L/h of about 10. A tool declared
/// with Timoshenko theory already includes its shear; this effect adds to it.
const Effect& ToolShear();

}  // namespace plumbline::effects
