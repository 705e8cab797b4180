// Guide play: a carriage of a prismatic axis that tilts in its guide.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// The carriage of a prismatic joint i rests tilted in the play of its guide, on the side to which
/// the weight tips it. Everything beyond it rotates about the origin o_i of the joint's frame by
///   phi = x_i s(M . x_i) value_x + y_i s(M . y_i) value_y               [rad]
///   s(m) = m / sqrt(m^2 + (W h)^2)
/// with M the moment about o_i of the weight beyond, W the magnitude of that weight, x_i the x axis
/// of the joint's DH frame and y_i = travel x x_i, both perpendicular to the travel. A value is
/// half the angle between the two end positions: clearance divided by the length of the carriage.
///
/// Why s has a finite width: a carriage loaded by W at the lever m/W is supported at its two ends,
/// 2h apart, with W/2 (1 +- m/(W h))   [statics of a beam on two supports]. For |m| < W h both ends
/// stay on the guide and no play is taken up; beyond that, one end lifts and the carriage tilts
/// across the clearance. The rolling elements between the ends lift one after the other, so the
/// transition is smooth: s is odd, rises with m / (W h), and is 0.71 where the end lifts and 0.98
/// at five times that moment. h = 25 mm is an assumption, half the length of a single carriage. Two
/// carriages on a rail have a wider support, in which the play is taken up later than s predicts;
/// their play is not recognised if the loads lie within that range. `backlash` by load has no such
/// width, because a tooth bears on one flank only.
///
/// Valid for rotations of milliradians, for a carriage that travels with the joint's frame, and
/// under weight alone, without inertial loads. As long as no moment changes sign, this is nearly a
/// constant rotation, equivalent to link_geometry, joint_offset or base_frame. Needs link masses.
/// Plausible range: 0..2e-3 rad, an assumption (0.1 mm of clearance over 50 mm, as in a plain guide
/// before its gib is adjusted). A rolling guide with 5 um of clearance has 1e-4 rad, a preloaded
/// one has no play [classes: THK, Selecting a Radial Clearance].
const Effect& GuidePlay();

}  // namespace plumbline::effects
