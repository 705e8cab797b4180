// Inverse kinematics of the controller: rigid nominal arm, straight tool.
#pragma once

#include <optional>

#include "tests/virtual_cell/arm.h"

namespace virtual_cell {

/// Joints that bring the nominal tip to X_BT, by damped least squares from `start`
/// (Levenberg: dq = J' (J J' + lambda^2)^-1 e, lambda shrinking with the error), kept inside the
/// limits; further start postures are tried if the first fails. Converges to 1e-9 m and 1e-9 rad.
/// @return nullopt if no start posture reaches the pose within the limits
std::optional<Joints> SolveInverseKinematics(const CellDescription& cell, const Arm& arm,
                                             const Motion& X_BT, const Joints& start);

/// The nominal tip at q.
Motion NominalTip(const CellDescription& cell, const Arm& arm, const Joints& q);

}  // namespace virtual_cell
