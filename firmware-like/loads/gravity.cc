#include "firmware-like/loads/gravity.h"

#include "firmware-like/model/link_twist.h"

namespace plumbline::loads {
namespace {

/// Midpoint between the link's DH frame and the joint axis, expressed in the DH frame.
Vec3 GuessedCentre(const model::Joint& joint, model::DhConvention convention) {
  if (convention == model::DhConvention::kProximal) return Vec3::Zero();
  return -0.5 * model::LinkTwist(joint).transpose() * Vec3(joint.a_m, 0, joint.d_m);
}

}  // namespace

GravityLoads::GravityLoads(const model::CellModel& cell) {
  for (const model::Joint& joint : cell.robot.joints) {
    const int next = static_cast<int>(links_.size()) + 1;
    if (!joint.link_mass_kg) known_from_ = next;
    if (joint.link_mass_kg.value_or(0) > 0 && !joint.link_com_m) guessed_before_ = next;
    links_.push_back(
        {joint.link_mass_kg.value_or(0.0),
         joint.link_com_m ? *joint.link_com_m : GuessedCentre(joint, cell.robot.convention)});
    types_.push_back(joint.type);
  }
  const double length_m = cell.tool.Length();
  const Vec3 mount_kg_m(0, 0, cell.tool.mount_mass_kg * length_m / 2);
  tool_mass_kg_ = cell.tool.mount_mass_kg;
  double z_m = 0;
  for (const model::ToolSegment& segment : cell.tool.segments) {
    const double mass_kg =
        segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m;
    tool_mass_kg_ += mass_kg;
    tool_body_kg_m_.z() += mass_kg * (z_m + segment.length_m / 2);
    z_m += segment.length_m;
  }
  if (tool_mass_kg_ > 0) tool_com_F_ = (mount_kg_m + tool_body_kg_m_) / tool_mass_kg_;
}

}  // namespace plumbline::loads
