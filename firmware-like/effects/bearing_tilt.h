// Joint bearings that tilt under the weight outboard of them.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// Everything outboard of a revolute joint i turns about the point o_i of its axis by
///   phi = value_i (M_i - axis (axis . M_i))             [rad/(N m)]
/// M_i the moment of the outboard weight about o_i: links, tool and payload. What the bearing bears
/// is the moment perpendicular to its axis; along it the drive yields, see joint_compliance.
/// [Harris & Kotzalas, Rolling Bearing Analysis, on moment stiffness of four-point and crossed
/// roller bearings: 0.1 to 1000 kN m/mrad]. Valid for milliradians; the torques of the other joints
/// are those of the arm without the tilt. Needs link masses. Of the first joint it is what
/// pedestal_compliance is.
const Effect& BearingTilt();

}  // namespace plumbline
