// Serial arm as a product of exponentials.
//
//   X_BLi(q) = exp(S_1 q_1) .. exp(S_i q_i) X_BLi(0)      [Brockett 1984]
// The screws S_i and the zero poses are derived once from the Denavit-Hartenberg rows, which are
// not used afterwards.
#pragma once

#include <vector>

#include "tests/virtual_cell/cell_description.h"

namespace virtual_cell {

struct Arm {
  std::vector<Screw> screws;       ///< of each joint at q = 0, in B
  std::vector<Motion> zero_poses;  ///< of each link frame at q = 0, in B
};

/// Lengths a and d are multiplied by `growth` (thermal growth; 1 at reference temperature).
Arm ArmFromDescription(const CellDescription& cell, double growth = 1);

/// The posture at joint values q [rad or m]: link frames and joint screws, both in B.
struct Posture {
  std::vector<Motion> links;
  std::vector<Screw> screws;
};
Posture PostureAt(const Arm& arm, const Joints& q);

/// A force and a moment on a link, both in the frame of the posture.
struct Load {
  int link;     ///< index of the link; joints 0..link carry the load
  Vec3 force;   ///< [N]
  Vec3 moment;  ///< about the frame's origin [N m]
};

/// Torque (or force) of each joint, as the reciprocal product of its screw with the outboard
/// wrench:
///   tau_i = omega_i . M + v_i . F, positive where the loads push the joint forward.
Joints JointTorques(const Posture& posture, const std::vector<Load>& loads);

}  // namespace virtual_cell
