// Exact Denavit-Hartenberg table of a serial chain.
#pragma once

#include "app/measure/urdf/joint_chain.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::measure {

/// The shortest rotation that turns z into a unit vector, as a pose; orthonormal to 1e-15 for every
/// vector, the one opposite to z and all close to it included.
Pose AxisFrame(const Vec3& axis);

/// The chain as a "dh" table with a base pose, so that the flange is the tip link and the
/// measurement frame is the base link. The robot's base lies on the first axis, nearest to the base
/// link's origin.
///   X_base_tip(q) = X_WB prod_i Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i) Rz(gamma_i)
/// Two successive axes are joined by
///   - their common normal if they enclose more than about a degree (sine 0.02, below which the
///     diagnosis treats axes as parallel, too): beta = 0
///   - else, the perpendicular from the previous axis to the next joint's origin, with beta for the
///     small angle between the axes [Hayati & Mirmirani 1985]; the common normal would lie metres
///     away and d would be ill-conditioned.
/// The last row carries the tip's full pose and may need beta and gamma. Masses and limits are
/// taken over; the centres of mass are turned into the DH frames.
/// @return  the robot, valid for the cell reader; exact to rounding
model::Robot RobotFromChain(const JointChain& chain);

}  // namespace plumbline::measure
