// Joints that yield to weight that nobody has weighed.
#pragma once

#include "firmware-like/effects/effect.h"

namespace plumbline {

/// For arms whose link masses are not declared: the torque of an unknown weight by its gravity
/// regressors. With z_i the joint's axis, g gravity and a_k one of the two directions across the
/// axis of joint k that turn with its link,
///   s_i += q<i> tau_i + sum_{k >= i} q<i>_link<k>_a  z_i . (a_k x g) / |g|
/// q<i> [rad/(N m)] is compliance, tau_i the torque of what is declared (tool, payload, links with
/// a mass). q<i>_link<k>_x and _y [rad] are that compliance times the weight's first moment along
/// a_k: of link k itself and of all that it carries. x and y are those of the link's frame after
/// joint k turned and before the twist alpha ("dh") or of its own frame ("mdh"); the part along the
/// joint's axis belongs to the link before [Atkeson, An & Hollerbach 1986, Int. J. Robot. Res.
/// 5(3); Khalil & Dombre 2002, Modeling, Identification and Control of Robots, ch. 9]. Frames are
/// those of the command: second order in the sag. Of revolute joints; links beyond a prismatic
/// joint have a first moment that changes with it, which is not modelled.
const Effect& GravitySag();

}  // namespace plumbline
