// Base frame error: a robot base that is not where it was declared in the measurement frame.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The base moves by (x, y, z) in W, and (roll, pitch, yaw) are added to its declared angles:
///   X_WB = (R = Rz(yaw) Ry(pitch) Rx(roll), p = p_WB + (x, y, z))
/// Gravity is fixed in W, so a rotated base also changes the joint loads. It is a nuisance
/// parameter if the cell declares the measurement frame as unaligned, and an effect if aligned.
/// File units: mm, deg. Valid away from pitch = 90 deg.
const Effect& BaseFrame();

}  // namespace plumbline::effects
