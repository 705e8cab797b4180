#include "firmware-like/loads/gravity.h"

namespace plumbline {
namespace {

/// Half way back along the link, from its frame to the joint's axis, in the frame after the joint.
Vec3 GuessedCentre(const Joint& joint, DhConvention convention) {
  if (convention == DhConvention::kProximal) return Vec3::Zero();
  const double ca = std::cos(joint.alpha_rad), sa = std::sin(joint.alpha_rad);
  return -0.5 * Vec3(joint.a_m, sa * joint.d_m, ca * joint.d_m);
}

}  // namespace

GravityLoads::GravityLoads(const CellModel& cell) {
  for (const Joint& joint : cell.robot.joints) {
    known_ = known_ && joint.link_mass_kg.has_value();
    guessed_ = guessed_ || !joint.link_com_m.has_value();
    links_.push_back(
        {joint.link_mass_kg.value_or(0.0),
         joint.link_com_m ? *joint.link_com_m : GuessedCentre(joint, cell.robot.convention)});
    types_.push_back(joint.type);
  }
  const double length_m = cell.tool.Length();
  Vec3 moment_kg_m(0, 0, cell.tool.mount_mass_kg * length_m / 2);
  tool_mass_kg_ = cell.tool.mount_mass_kg;
  double z_m = 0;
  for (const ToolSegment& segment : cell.tool.segments) {
    const double mass_kg =
        segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m;
    tool_mass_kg_ += mass_kg;
    moment_kg_m.z() += mass_kg * (z_m + segment.length_m / 2);
    z_m += segment.length_m;
  }
  if (tool_mass_kg_ > 0) tool_com_F_ = moment_kg_m / tool_mass_kg_;
}

void GravityLoads::Torques(const Posture& posture, const Vec3& g_B, const Payload& payload,
                           JointVector& tau) const {
  tau.resize(posture.size);
  // sum m r and sum m of everything outward of the joint; gravity is uniform.
  const Pose& X_BF = posture.X_BF();
  double mass_kg = tool_mass_kg_ + payload.mass_kg;
  Vec3 moment_kg_m =
      tool_mass_kg_ * (X_BF * tool_com_F_) + payload.mass_kg * (X_BF * payload.cog_F);
  for (int i = posture.size - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    mass_kg += links_[k].mass_kg;
    moment_kg_m += links_[k].mass_kg * (posture.X_BL[k] * links_[k].com_L);
    if (types_[k] == JointType::kRevolute) {
      tau[i] = posture.axis_B[k].dot((moment_kg_m - mass_kg * posture.point_B[k]).cross(g_B));
    } else {
      tau[i] = mass_kg * posture.axis_B[k].dot(g_B);
    }
  }
}

}  // namespace plumbline
