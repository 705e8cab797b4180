// Link geometry: links whose lengths or twists differ from the DH table.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// a_i, d_i and alpha_i of the DH table are increased by their values   [Denavit & Hartenberg 1955,
/// J. Appl. Mech. 22; calibrated in this way by Nubiola & Bonev 2013, Robot. Comput.-Integr. Manuf.
/// 29(1)]. File units: mm, deg. Between parallel axes, d_i of one joint is equivalent to d of the
/// next, and alpha is not a suitable parameter; the rank of the data over the measured poses
/// decides which parameters can be estimated.
const Effect& LinkGeometry();

}  // namespace plumbline::effects
