// A fictitious heavy six-axis arm with a bending tool, for tests.
#pragma once

#include <numbers>
#include <random>

#include "firmware-like/model/cell_model.h"

namespace plumbline::test {

inline constexpr double kDegree = std::numbers::pi / 180;

inline model::Joint MakeJoint(double a, double alpha_deg, double d, double offset_deg,
                              double min_deg, double max_deg, double mass_kg, const Vec3& com,
                              double compliance) {
  model::Joint joint;
  joint.a_m = a;
  joint.alpha_rad = alpha_deg * kDegree;
  joint.d_m = d;
  joint.theta_offset_rad = offset_deg * kDegree;
  joint.min = min_deg * kDegree;
  joint.max = max_deg * kDegree;
  joint.link_mass_kg = mass_kg;
  joint.link_com_m = com;
  joint.compliance_rad_per_Nm = compliance;
  return joint;
}

inline model::CellModel HeavyArm() {
  model::CellModel cell;
  cell.robot.name = "heavy";
  cell.robot.X_WB.p = Vec3(0.4, -0.2, 0.1);
  cell.robot.X_WB.R = Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix();
  cell.robot.joints = {MakeJoint(0.40, -90, 0.70, 0, -180, 180, 300, {-0.2, 0.1, 0}, 3e-7),
                       MakeJoint(1.10, 0, 0, -90, -70, 80, 180, {-0.6, 0, 0.1}, 4e-7),
                       MakeJoint(0.10, -90, 0, 0, -120, 110, 120, {-0.05, 0, 0.05}, 6e-7),
                       MakeJoint(0, 90, 1.20, 0, -300, 300, 70, {0, -0.2, 0}, 2e-6),
                       MakeJoint(0, -90, 0, 0, -125, 125, 30, {0, 0, 0.02}, 2.5e-6),
                       MakeJoint(0, 0, 0.21, 0, -350, 350, 15, {0, 0, -0.03}, 4e-6)};
  cell.robot.joints[0].sign = -1;
  model::ToolSegment segment;
  segment.length_m = 1.0;
  segment.section = model::SquareTubeSection(0.08, 0.005);
  segment.material = {70e9, 0.33, 2700};
  cell.tool.rigid = false;
  cell.tool.segments = {segment};
  cell.tool.tcp_F = Vec3(0, 0, 1.0);
  cell.tool.mount_mass_kg = 8;
  cell.payload_cog_F = Vec3(0.02, 0.05, 1.1);
  return cell;
}

/// Joint positions within the limits, with the wrist away from its singular posture.
inline model::JointVector RandomPosture(const model::CellModel& cell, std::mt19937& random) {
  model::JointVector q(cell.robot.size());
  for (int i = 0; i < q.size(); ++i) {
    const model::Joint& joint = cell.robot.joints[static_cast<std::size_t>(i)];
    q[i] = std::uniform_real_distribution(0.9 * joint.min, 0.9 * joint.max)(random);
  }
  if (q.size() == 6 && std::abs(q[4]) < 0.3) q[4] += q[4] < 0 ? -0.3 : 0.3;
  return q;
}

}  // namespace plumbline::test
