// Bearing tilt: a joint bearing that tilts under the weight outboard of it.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// Everything outboard of a revolute joint i rotates about the point o_i of its axis by
///   phi = value_i (M_i - axis (axis . M_i))             [rad/(N m)]
/// with M_i the moment of the outboard weight (links, tool, payload) about o_i. The bearing carries
/// the moment perpendicular to its axis; the moment along the axis acts on the drive, see
/// joint_compliance. [Harris & Kotzalas, Rolling Bearing Analysis, moment stiffness of four-point
/// and crossed roller bearings: 0.1 to 1000 kN m/mrad]. Valid for rotations of milliradians; the
/// torques of the other joints are computed without the tilt. Needs link masses. For the first
/// joint, identical to pedestal_compliance.
const Effect& BearingTilt();

}  // namespace plumbline::effects
