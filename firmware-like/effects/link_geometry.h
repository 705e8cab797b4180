// Links that are longer, or more twisted, than the DH table says.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// a_i, d_i and alpha_i of the DH table each get their value added   [Denavit & Hartenberg 1955, J.
/// Appl. Mech. 22; calibrated like this by Nubiola & Bonev 2013, Robot. Comput.-Integr. Manuf.
/// 29(1)]. Units of the files: mm, deg. Between parallel axes d_i of one joint is d of the next,
/// and alpha is no good parameter there: the rank of the poses measured tells.
const Effect& LinkGeometry();

}  // namespace plumbline
