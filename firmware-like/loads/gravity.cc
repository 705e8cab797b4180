#include "firmware-like/loads/gravity.h"

#include <algorithm>

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
  couplings_ = cell.robot.couplings;
  for (const model::JointCoupling& coupling : couplings_) {
    if (coupling.drive != model::CouplingDrive::kReading) continue;
    if (!known(coupling.joint)) known_from_ = std::max(known_from_, coupling.of + 1);
    if (guessed(coupling.joint)) guessed_before_ = std::max(guessed_before_, coupling.of + 1);
  }
  for (int k = 0; k < cell.tools(); ++k) tools_.push_back(MassOf(cell.ToolAt(k)));
}

GravityLoads::ToolMass GravityLoads::MassOf(const model::Tool& tool) {
  ToolMass mass;
  const Vec3 mount_kg_m(0, 0, tool.mount_mass_kg * tool.Length() / 2);
  mass.mass_kg = tool.mount_mass_kg;
  double z_m = 0;
  for (const model::ToolSegment& segment : tool.segments) {
    const double mass_kg =
        segment.material.density_kg_m3 * segment.section.area_m2 * segment.length_m;
    mass.mass_kg += mass_kg;
    mass.body_kg_m.z() += mass_kg * (z_m + segment.length_m / 2);
    z_m += segment.length_m;
  }
  if (mass.mass_kg > 0) mass.com_F = (mount_kg_m + mass.body_kg_m) / mass.mass_kg;
  return mass;
}

}  // namespace plumbline::loads
