// Link geometry: links whose lengths or twists differ from the DH table.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// a_i, d_i and alpha_i of the DH table are increased by their values   [Denavit & Hartenberg 1955,
/// J. Appl. Mech. 22; calibrated in this way by Nubiola & Bonev 2013, Robot. Comput.-Integr. Manuf.
/// 29(1)]. File units: mm, deg. If the axes of two successive joints are parallel,
/// their d have the same effect, and a small misalignment of the axes is not a small change of
/// alpha. Which parameters can be estimated follows from the rank of the data over the measured
/// poses.
const Effect& LinkGeometry();

}  // namespace plumbline::effects
