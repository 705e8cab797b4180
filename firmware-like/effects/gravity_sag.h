// Gravity sag: joint compliance under links of unknown mass.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline::effects {

/// For arms without declared link masses: the torque of an unknown weight, expressed by its gravity
/// regressors. With z_i the joint's axis, g gravity and a_k one of the two directions perpendicular
/// to the axis of joint k that rotate with its link,
///   s_i += q<i> tau_i + sum_{k >= i} q<i>_link<k>_a  z_i . (a_k x g) / |g|
/// q<i> [rad/(N m)] is the compliance and tau_i the torque of everything declared (tool, payload,
/// links with a mass). q<i>_link<k>_x and _y [rad] are that compliance times the first moment of
/// the weight along a_k, of link k and everything it carries. x and y are the axes of the link's
/// frame after rotation of joint k and before the twist alpha ("dh"), or of its own frame ("mdh").
/// The component along the joint's axis is attributed to the previous link [Atkeson, An &
/// Hollerbach 1986, Int. J. Robot. Res. 5(3); Khalil & Dombre 2002, Modeling, Identification and
/// Control of Robots, ch. 9]. Frames are evaluated at the commanded joints; the error is of second
/// order in the sag. Revolute joints only. The first moment of links beyond a prismatic joint
/// changes with that joint, which is not modelled.
const Effect& GravitySag();

}  // namespace plumbline::effects
