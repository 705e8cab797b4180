// Carriages of prismatic axes that tip in the play of their guides.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// The carriage of a prismatic joint i lies tilted in the play of its guide, on the side to which
/// the weight tips it; everything beyond it turns about the origin o_i of the joint's frame by
///   phi = x_i s(M . x_i) value_x + y_i s(M . y_i) value_y               [rad]
///   s(m) = m / sqrt(m^2 + (W h)^2)
/// M the moment about o_i of the weight beyond, W the size of that weight, x_i the x axis of the
/// joint's DH frame and y_i = travel x x_i, both across the travel. A value is half the angle
/// between both sides: clearance over the length of the carriage.
///
/// Why s has a width: a carriage loaded by W at the lever m/W is carried at its two ends, 2h apart,
/// with W/2 (1 +- m/(W h))   [statics of a beam on two supports]. Within |m| < W h both stay on the
/// guide and no play is taken up; beyond it one end lifts and the carriage lies across the
/// clearance. The rolling elements between the ends lift one after the other, so that the step is
/// smooth: s is odd, rises by m / (W h) and is 0.71 where the end lifts, 0.98 at five times that.
/// h = 25 mm is a judgement, half the length of a single carriage; two carriages on a rail have a
/// wider rest, in which the real play is taken up later than s says, and are not recognised where
/// loads lie within it. `backlash` by load has no such width: one tooth has one flank.
///
/// Valid for milliradians and where the carriage travels with the joint's frame; under the weight
/// alone, without what acceleration adds. While no moment changes sign this is all but a constant
/// turn, as link_geometry, joint_offset or base_frame have it. Needs link masses.
/// Plausible: 0..2e-3 rad, a judgement: 0.1 mm of clearance over 50 mm, as of a plain guide before
/// its gib is set; a rolling guide with 5 um has 1e-4 rad, a preloaded one none   [the classes:
/// THK, Selecting a Radial Clearance].
const Effect& GuidePlay();

}  // namespace plumbline
