// A robot that stands elsewhere in the measurement frame than declared.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The base moves by (x, y, z) in W, and (roll, pitch, yaw) add to its declared angles:
///   X_WB = (R = Rz(yaw) Ry(pitch) Rx(roll), p = p_WB + (x, y, z))
/// Gravity is given in W and stays there: a turned base loads the joints otherwise. A nuisance
/// where the cell calls the measurement frame unaligned, an effect where it calls it aligned. Units
/// of the files: mm, deg. Valid away from pitch = 90 deg.
const Effect& BaseFrame();

}  // namespace plumbline
