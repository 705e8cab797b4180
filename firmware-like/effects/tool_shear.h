// A short tool whose sections slide as well as turn.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The tip moves by F L / (kappa G A) across the tool, F the payload's transverse force   [Gere &
/// Timoshenko, Mechanics of Materials; kappa: Cowper 1966, J. Appl. Mech. 33(2)]. Unit: 1. The
/// number that is linear, and that Add() gets, is 1/kappa: 0 where shear is neglected. A full
/// rectangle has kappa 0.85, a thin square tube 0.44. Matters below L/h of about 10; a tool
/// declared as Timoshenko's has its shear already, and this comes on top.
const Effect& ToolShear();

}  // namespace plumbline
