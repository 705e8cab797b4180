#include "tests/virtual_cell/world.h"

#include <cmath>

namespace virtual_cell {
namespace {

double SignOf(double value) {
  return value > 0 ? 1.0 : value < 0 ? -1.0 : 0.0;
}

}  // namespace

World::World(CellDescription cell, Effects effects)
    : cell_(std::move(cell)), effects_(std::move(effects)) {}

Vec3 World::Gravity() const {
  const Vec3 turn(effects_.Value("gravity_direction", "x"),
                  effects_.Value("gravity_direction", "y"), 0);
  return RotationFromVector(turn) * cell_.gravity_W;
}

double World::TipMass(double payload_kg) const {
  return payload_kg * (1 + effects_.Value("payload_mass", "scale")) +
         effects_.Value("payload_mass", "constant");
}

RodShape World::Tool(const WorldInputs& now, const Vec3& g_F, const Vec3& guess) const {
  const Vec3 cog_F = cell_.payload_cog_F + 1e-3 * Vec3(effects_.Value("payload_cog", "x"),
                                                       effects_.Value("payload_cog", "y"),
                                                       effects_.Value("payload_cog", "z"));
  const Vec3 force = TipMass(now.payload_kg) * g_F;
  RodShape shape;
  if (cell_.rigid_tool) {
    shape.root_force = force;
    shape.root_moment = cog_F.cross(force);
    shape.tip.translation() = cell_.tip_F;
    shape.converged = true;
  } else {
    RodOptions options;
    const double creep =
        effects_.Has("creep")
            ? 1 + effects_.Value("creep", "amplitude") *
                      std::log1p(now.time_s / effects_.Value("creep", "time_constant", 1))
            : 1;
    options.bending_factor = (1 + effects_.Value("tool_stiffness", "ratio")) / creep;
    options.shear_factor =
        effects_.Value("tool_shear", "kappa", cell_.sheared_tool ? cell_.shear_factor : 0);
    shape = SolveRod(cell_.rod, {g_F, force, cog_F - cell_.tip_F}, options, guess);
  }
  // The coupling deflects under the transverse part of its moment.
  const double coupling = effects_.Value("tool_root_compliance", "compliance");
  Vec3 bend = shape.root_moment * coupling;
  bend.z() = 0;
  Motion turned = Motion::Identity();
  turned.linear() = RotationFromVector(bend);
  shape.tip = turned * shape.tip;
  shape.tip.translation() +=
      1e-3 * Vec3(effects_.Value("tool_frame", "x"), effects_.Value("tool_frame", "y"),
                  effects_.Value("tool_frame", "z"));
  return shape;
}

std::vector<Load> World::Loads(const Posture& posture, const Vec3& g_B, const RodShape& tool,
                               const Motion& X_BF) const {
  std::vector<Load> loads;
  const int last = cell_.size() - 1;
  for (int i = 0; i <= last; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const JointDescription& joint = cell_.joints[k];
    const Vec3 force = joint.link_mass_kg * g_B;
    loads.push_back({i, force, (posture.links[k] * joint.link_com_m).cross(force)});
  }
  const Vec3 mount = cell_.mount_mass_kg * g_B;
  loads.push_back({last, mount, (X_BF * Vec3(cell_.tip_F / 2)).cross(mount)});
  const Vec3 root_force = X_BF.linear() * tool.root_force;
  loads.push_back(
      {last, root_force, X_BF.linear() * tool.root_moment + X_BF.translation().cross(root_force)});
  return loads;
}

Joints World::Deflection(const WorldInputs& now, const Joints& torque) const {
  Joints s = Joints::Zero(torque.size());
  for (int i = 0; i < cell_.size(); ++i) {
    const double q = now.q[i];
    const double move = i < now.last_move.size() ? now.last_move[i] : 0;
    double tau = torque[i];
    if (i == 1) {
      tau += effects_.Value("counterbalance", "q2_amplitude") *
             std::sin(q + effects_.Value("counterbalance", "q2_phase"));
    }
    const double c = cell_.joints[static_cast<std::size_t>(i)].compliance +
                     effects_.OfJoint("joint_compliance", i);
    s[i] = c * tau - effects_.OfJoint("joint_hardening", i) * tau * tau * tau;
    s[i] += effects_.OfJoint("joint_offset", i) + effects_.OfJoint("gear_ratio", i) * q;
    s[i] += effects_.OfJoint("backlash", i) * SignOf(effects_.ByMove("backlash") ? move : tau);
    s[i] -= effects_.OfJoint("approach_lag", i) * move;
    s[i] += effects_.OfJoint("gear_periodic", i, "_amplitude") *
            std::sin(effects_.OfJoint("gear_periodic", i, "_cycles") * q +
                     effects_.OfJoint("gear_periodic", i, "_phase"));
  }
  return s;
}

Motion World::Base(const WorldInputs& now) const {
  const auto mm = [this](const char* id) {
    return Vec3(effects_.Value(id, "x"), effects_.Value(id, "y"), effects_.Value(id, "z"));
  };
  const Vec3 rpy_deg(effects_.Value("base_frame", "roll"), effects_.Value("base_frame", "pitch"),
                     effects_.Value("base_frame", "yaw"));
  const Motion moved = MotionFromXyzMmRpyDeg(mm("base_frame"), rpy_deg);
  Motion X_WB = cell_.X_WB;
  X_WB.linear() = moved.linear() * X_WB.linear();
  X_WB.translation() += moved.translation();
  if (effects_.Has("thermal_drift")) {
    const double share =
        1 - std::exp(-now.time_s / effects_.Value("thermal_drift", "time_constant", 1));
    X_WB.translation() += 1e-3 * share * mm("thermal_drift");
  }
  if (effects_.Has("step_event") && now.time_s >= effects_.Value("step_event", "time")) {
    X_WB.translation() += 1e-3 * mm("step_event");
  }
  return X_WB;
}

Truth World::Settle(const WorldInputs& now) const {
  const double growth = 1 + effects_.Value("thermal_growth", "alpha") *
                                (now.temperature_C - cell_.reference_temperature_C);
  const Arm arm = ArmFromDescription(cell_, growth);
  const Motion still_base = Base(now);
  const Vec3 g_W = Gravity();
  const double pedestal = effects_.Value("pedestal_compliance", "compliance");

  Truth truth;
  truth.deflection = Joints::Zero(now.q.size());
  Vec3 root_moment = Vec3::Zero();
  Vec3 tilt_W = Vec3::Zero();
  for (int pass = 0; pass < 100 && !truth.converged; ++pass) {
    Motion X_WB = still_base;
    X_WB.linear() = RotationFromVector(tilt_W) * X_WB.linear();
    const Vec3 g_B = X_WB.linear().transpose() * g_W;
    const Posture posture = PostureAt(arm, now.q + truth.deflection);
    const Motion& X_BF = posture.links.back();
    const RodShape tool = Tool(now, X_BF.linear().transpose() * g_B, root_moment);
    if (!tool.converged) break;
    root_moment = tool.root_moment;
    const std::vector<Load> loads = Loads(posture, g_B, tool, X_BF);
    truth.torque = JointTorques(posture, loads);
    truth.X_WF = X_WB * X_BF;
    truth.X_WT = truth.X_WF * tool.tip;

    Vec3 base_moment = Vec3::Zero();
    for (const Load& load : loads) base_moment += load.moment;
    base_moment = X_WB.linear() * base_moment;
    const Vec3 up = g_W.normalized();
    const Vec3 tilt = pedestal * (base_moment - up * up.dot(base_moment));
    const Joints s = Deflection(now, truth.torque);
    const double change = (s - truth.deflection).cwiseAbs().maxCoeff() + (tilt - tilt_W).norm();
    truth.converged = change < 1e-12;
    truth.deflection = s;
    tilt_W = tilt;
  }
  return truth;
}

double GravityEnergyStraightTool(const CellDescription& cell, const Joints& q, double payload_kg) {
  const Posture posture = PostureAt(ArmFromDescription(cell), q);
  const Vec3 g_B = cell.X_WB.linear().transpose() * cell.gravity_W;
  double energy = 0;
  for (std::size_t i = 0; i < cell.joints.size(); ++i) {
    const JointDescription& joint = cell.joints[i];
    energy -= joint.link_mass_kg * g_B.dot(posture.links[i] * joint.link_com_m);
  }
  const Motion& X_BF = posture.links.back();
  double z = 0;
  for (const RodSegment& rod : cell.rod) {
    energy -= rod.weight_kg_m * rod.length_m * g_B.dot(X_BF * Vec3(0, 0, z + rod.length_m / 2));
    z += rod.length_m;
  }
  energy -= cell.mount_mass_kg * g_B.dot(X_BF * Vec3(cell.tip_F / 2));
  return energy - payload_kg * g_B.dot(X_BF * cell.payload_cog_F);
}

}  // namespace virtual_cell
