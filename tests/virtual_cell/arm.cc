#include "tests/virtual_cell/arm.h"

namespace virtual_cell {
namespace {

Motion Turn(const Vec3& axis, double angle) {
  return Exponential({axis, Vec3::Zero()}, angle);
}
Motion Shift(const Vec3& direction, double distance) {
  return Exponential({Vec3::Zero(), direction}, distance);
}

}  // namespace

Arm ArmFromDescription(const CellDescription& cell, double growth) {
  const Vec3 x = Vec3::UnitX(), z = Vec3::UnitZ();
  Arm arm;
  Motion reached = Motion::Identity();
  for (const JointDescription& joint : cell.joints) {
    const Motion across =
        Shift(x, joint.a_m * growth) * Turn(x, joint.alpha_rad);  // these two commute
    const Motion along = Turn(z, joint.offset_rad) * Shift(z, joint.d_m * growth);
    if (cell.proximal_dh) reached = reached * across;
    const Vec3 axis = reached.linear() * z * joint.sign;
    const Vec3 moment = reached.translation().cross(axis);  // -axis x point
    arm.screws.push_back(joint.prismatic ? Screw{Vec3::Zero(), axis} : Screw{axis, moment});
    reached = reached * along;
    if (!cell.proximal_dh) reached = reached * across;
    arm.zero_poses.push_back(reached);
  }
  return arm;
}

Posture PostureAt(const Arm& arm, const Joints& q) {
  Posture posture;
  Motion moved = Motion::Identity();
  for (std::size_t i = 0; i < arm.screws.size(); ++i) {
    posture.screws.push_back(Transported(moved, arm.screws[i]));
    moved = moved * Exponential(arm.screws[i], q[static_cast<Eigen::Index>(i)]);
    posture.links.push_back(moved * arm.zero_poses[i]);
  }
  return posture;
}

Joints JointTorques(const Posture& posture, const std::vector<Load>& loads) {
  Joints torques = Joints::Zero(static_cast<Eigen::Index>(posture.screws.size()));
  for (const Load& load : loads) {
    for (int i = 0; i <= load.link; ++i) {
      const Screw& screw = posture.screws[static_cast<std::size_t>(i)];
      torques[i] += screw.omega.dot(load.moment) + screw.v.dot(load.force);
    }
  }
  return torques;
}

}  // namespace virtual_cell
