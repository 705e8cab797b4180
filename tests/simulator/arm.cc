#include "tests/simulator/arm.h"

#include <Eigen/Geometry>
#include <cmath>

namespace simulator {

using Eigen::Vector3d;

/// A frame that walks along the arm: it turns and moves along its own axes.
struct Walker {
  Vector3d at, x, y, z;

  void TurnAboutZ(double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const Vector3d turned = c * x + s * y;
    y = c * y - s * x;
    x = turned;
  }
  void TurnAboutX(double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const Vector3d turned = c * y + s * z;
    z = c * z - s * y;
    y = turned;
  }
  void TurnAboutY(double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    const Vector3d turned = c * z + s * x;
    x = c * x - s * z;
    z = turned;
  }
  Vector3d Point(const Vector3d& p) const { return at + p.x() * x + p.y() * y + p.z() * z; }
  Vector3d Into(const Vector3d& v) const { return {x.dot(v), y.dot(v), z.dot(v)}; }
};

namespace {

Vector3d TurnedAbout(const Vector3d& axis, double angle_rad, const Vector3d& v) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return v * c + axis.cross(v) * s + axis * axis.dot(v) * (1.0 - c);
}

Vector3d Turned(const Vector3d& rotation_rad, const Vector3d& v) {
  const double angle = rotation_rad.norm();
  return angle == 0.0 ? v : TurnedAbout(rotation_rad / angle, angle, v);
}

double Sign(double value) {
  return value > 0.0 ? 1.0 : value < 0.0 ? -1.0 : 0.0;
}

/// R = Rz(yaw) Ry(pitch) Rx(roll), a column of it.
Vector3d RollPitchYaw(const Vector3d& rpy, const Vector3d& v) {
  return TurnedAbout(
      Vector3d::UnitZ(), rpy.z(),
      TurnedAbout(Vector3d::UnitY(), rpy.y(), TurnedAbout(Vector3d::UnitX(), rpy.x(), v)));
}

}  // namespace

struct Arm::Posture {
  Vector3d base;
  Walker flange;
  Vector3d gravity;
  Vector3d base_moment_Nm;
  Eigen::VectorXd torque_Nm;
  double work_J;
};

Vector3d Bending(const Tool& tool, const Vector3d& g_F, double payload_kg, const Vector3d& cog_m) {
  if (tool.rigid) return Vector3d::Zero();
  const double length = tool.length_m;
  const double stiffness = tool.youngs_modulus_Pa * tool.SecondMomentM4();
  const Vector3d force = payload_kg * g_F;
  const Vector3d moment = (cog_m - Vector3d(0.0, 0.0, length)).cross(force);
  const Vector3d line_load = tool.density_kg_m3 * tool.AreaM2() * g_F;
  const double by_force = length * length * length / (3.0 * stiffness);
  const double by_moment = length * length / (2.0 * stiffness);
  const double by_weight = length * length * length * length / (8.0 * stiffness);
  return {force.x() * by_force + moment.y() * by_moment + line_load.x() * by_weight,
          force.y() * by_force - moment.x() * by_moment + line_load.y() * by_weight, 0.0};
}

Vector3d Arm::Gravity() const {
  return Turned({changes_.gravity_rad.x(), changes_.gravity_rad.y(), 0.0}, cell_.gravity_m_s2);
}

double Arm::Payload(const Row& row) const {
  if (!cell_.payload_cog_m) return 0.0;
  return row.payload_kg * (1.0 + changes_.mass_scale) + changes_.mass_constant_kg;
}

void Arm::Place(const Row& row, const Eigen::VectorXd& s_rad, const Vector3d& tilt_rad,
                Posture& posture) const {
  Vector3d base = cell_.base_m, rpy = cell_.base_rpy_rad;
  for (const Changes::Frame& frame : changes_.frames) {
    if (!frame.session.empty() && frame.session != row.session) continue;
    base += frame.xyz_m;
    rpy += frame.rpy_rad;
  }
  for (const Changes::Drift& drift : changes_.drifts) {
    base += drift.xyz_m * (1.0 - std::exp(-row.t_s / drift.time_constant_s));
  }
  for (const Changes::Step& step : changes_.steps) {
    if (!step.of_tool && row.t_s >= step.time_s) base += step.xyz_m;
  }
  base += changes_.sine_m *
          std::sin(2.0 * M_PI * row.t_s / changes_.sine_period_s + changes_.sine_phase_rad);
  base += changes_.pressure_m_per_bar * (row.pressure_bar - 1.0);
  const double pressure = (row.pressure_bar - 1.0) / 0.01;
  const double warmth = (row.temp_C - cell_.reference_temperature_C) / 10.0;
  base += changes_.weather_m[0] * pressure + changes_.weather_m[1] * warmth +
          changes_.weather_m[2] * pressure * warmth;

  Walker walker{base, Turned(tilt_rad, RollPitchYaw(rpy, Vector3d::UnitX())),
                Turned(tilt_rad, RollPitchYaw(rpy, Vector3d::UnitY())),
                Turned(tilt_rad, RollPitchYaw(rpy, Vector3d::UnitZ()))};
  const int n = int(cell_.joints.size());
  const double growth = 1.0 + changes_.thermal_per_K * (row.temp_C - cell_.reference_temperature_C);
  std::vector<Vector3d> axis(n), point(n), centre(n);
  for (int i = 0; i < n; ++i) {
    const Joint& joint = cell_.joints[i];
    const double theta = joint.sign * (row.q_rad[i] + s_rad[i]) + joint.offset_rad;
    const double a = (joint.a_m + changes_.a_m[i]) * growth;
    const double d = (joint.d_m + changes_.d_m[i]) * growth;
    const double alpha = joint.alpha_rad + changes_.alpha_rad[i];
    if (cell_.proximal) {
      walker.TurnAboutX(alpha);
      walker.at += a * walker.x;
      walker.TurnAboutY(changes_.beta_rad[i]);
    }
    axis[i] = joint.sign * walker.z;
    point[i] = walker.at;
    walker.TurnAboutZ(theta);
    walker.at += d * walker.z;
    if (!cell_.proximal) {
      walker.at += a * walker.x;
      walker.TurnAboutX(alpha);
      walker.TurnAboutY(changes_.beta_rad[i]);
    }
    centre[i] = walker.Point(joint.com_m);
  }

  posture.base = base;
  posture.flange = walker;
  posture.gravity = Gravity();
  posture.torque_Nm.resize(n);
  double mass = 0.0;
  Vector3d first_moment = Vector3d::Zero();  // sum of m r, outboard
  const auto add = [&](double kg, const Vector3d& at) {
    mass += kg;
    first_moment += kg * at;
  };
  if (!cell_.tool.rigid) {
    add(cell_.tool.BodyMassKg() + cell_.tool.mount_mass_kg,
        walker.Point({0.0, 0.0, cell_.tool.length_m / 2.0}));
  }
  if (cell_.payload_cog_m) add(Payload(row), walker.Point(*cell_.payload_cog_m + changes_.cog_m));
  for (int i = n - 1; i >= 0; --i) {
    add(cell_.joints[i].mass_kg, centre[i]);
    posture.torque_Nm[i] = axis[i].dot((first_moment - mass * point[i]).cross(posture.gravity));
  }
  if (row.tau_Nm.size() == n) posture.torque_Nm = row.tau_Nm;
  posture.base_moment_Nm = (first_moment - mass * base).cross(posture.gravity);
  posture.work_J = posture.gravity.dot(first_moment);
  if (n > 1) {
    posture.torque_Nm[1] +=
        changes_.counterbalance_Nm * std::sin(row.q_rad[1] + changes_.counterbalance_phase_rad);
  }
}

Eigen::VectorXd Arm::Deflection(const Row& row, const Eigen::VectorXd& torque_Nm) const {
  const int n = int(cell_.joints.size());
  Eigen::VectorXd s = changes_.coupling * row.q_rad;
  const double longest = row.last_move_rad.cwiseAbs().maxCoeff();
  for (int i = 0; i < n; ++i) {
    const double tau = torque_Nm[i];
    const double compliance =
        cell_.joints[i].compliance_rad_per_Nm.value_or(0.0) + changes_.compliance[i];
    const double speed = longest > 0.0 ? row.last_move_rad[i] / longest : 0.0;
    s[i] +=
        compliance * tau - changes_.hardening[i] * tau * tau * tau + changes_.offset[i] +
        changes_.gear_ratio[i] * row.q_rad[i] + changes_.backlash_load[i] * Sign(tau) +
        changes_.backlash_move[i] * Sign(row.last_move_rad[i]) -
        changes_.lag[i] * row.last_move_rad[i] -
        speed * (changes_.following[i] + changes_.friction[i] * std::abs(tau)) -
        changes_.latency_s * row.qd_rad_s[i] - changes_.inertia[i] * row.qdd_rad_s2[i] -
        changes_.viscous_squared[i] * row.qd_rad_s[i] * std::abs(row.qd_rad_s[i]) +
        changes_.warm_payload[i] * row.payload_kg * (row.temp_C - cell_.reference_temperature_C);
  }
  for (const Changes::Periodic& p : changes_.periodics) {
    s[p.joint] += p.amplitude_rad * std::sin(p.cycles * row.q_rad[p.joint] + p.phase_rad);
  }
  for (const Changes::Bump& bump : changes_.bumps) {
    const auto bell = [&](double centre) {
      const double off = std::remainder(row.q_rad[bump.joint] - centre, 2.0 * M_PI);
      return std::exp(-0.5 * off * off / (bump.width_rad * bump.width_rad));
    };
    s[bump.joint] +=
        bump.amplitude_rad * (bell(bump.centre_rad) - 0.7 * bell(bump.centre_rad + bump.second));
  }
  return s;
}

Arm::Posture Arm::Solve(const Row& row) const {
  Posture posture;
  Eigen::VectorXd s = Eigen::VectorXd::Zero(int(cell_.joints.size()));
  Vector3d tilt = Vector3d::Zero();
  for (int pass = 0; pass < 30; ++pass) {
    Place(row, s, tilt, posture);
    const Eigen::VectorXd next = Deflection(row, posture.torque_Nm);
    const Vector3d next_tilt = changes_.pedestal * posture.base_moment_Nm;
    const double moved = (next - s).cwiseAbs().maxCoeff() + (next_tilt - tilt).norm();
    s = next;
    tilt = next_tilt;
    if (pass > 0 && moved < 1e-14) break;
  }
  Place(row, s, tilt, posture);
  return posture;
}

/// Bearing and distance, each as the wrong camera takes it.
Vector3d Arm::Seen(const Row& row, const Vector3d& p) const {
  if (!cell_.camera) return p;
  const Vector3d at = cell_.camera->at_m, rpy = cell_.camera->rpy_rad;
  const Vector3d ahead = RollPitchYaw(rpy, Vector3d::UnitZ());
  const double depth = ahead.dot(p - at);
  if (depth <= 0.0) return p;
  double zoomed = 1.0;  // true over used focal length is 1 / this
  for (const Changes::Zoom& zoom : changes_.zooms) {
    if (row.t_s >= zoom.time_s) zoomed += zoom.stretch;
  }
  // On the film of focal length 1: the tangents of the bearing.
  const Vector3d across = (p - at) - depth * ahead;
  const double radius = across.norm() / depth;
  const double bent = changes_.lens_k1 * radius * radius;
  const double told_depth = depth * zoomed * (1.0 - 2.0 * bent);
  // A magnified image of a magnified body: its place across does not change with the zoom.
  const Vector3d told_across = across * (1.0 - bent);
  return at + (1.0 + changes_.tag_size) * (told_across + told_depth * ahead);
}

Vector3d Arm::Tip(const Row& row) const {
  const Posture posture = Solve(row);
  const Walker& flange = posture.flange;
  const Tool& tool = cell_.tool;
  Vector3d tip = tool.rigid ? tool.tcp_m : Vector3d(0.0, 0.0, tool.length_m);
  if (!tool.rigid) {
    const Vector3d straight = tip;
    const Vector3d g = flange.Into(posture.gravity);
    const double payload = Payload(row);
    const Vector3d cog =
        cell_.payload_cog_m ? Vector3d(*cell_.payload_cog_m + changes_.cog_m) : Vector3d::Zero();
    const double stretch = 1.0 + changes_.creep * std::log1p(row.t_s / changes_.creep_tau_s) +
                           changes_.bending_per_kg * row.payload_kg;
    tip += Bending(tool, g, payload, cog) / (1.0 + changes_.tool_ratio) * stretch;
    if (changes_.shear_kappa != 0.0) {
      const double shear_modulus = tool.youngs_modulus_Pa / (2.0 * (1.0 + tool.poisson_ratio));
      tip += payload * Vector3d(g.x(), g.y(), 0.0) * tool.length_m /
             (changes_.shear_kappa * shear_modulus * tool.AreaM2());
    }
    Vector3d root_moment = payload * cog.cross(g) + tool.BodyMassKg() * (0.5 * straight).cross(g);
    root_moment.z() = 0.0;
    tip += (changes_.root_compliance * root_moment).cross(straight);
    const double warm_K = row.temp_C - cell_.reference_temperature_C;
    tip.z() += changes_.growth_mm_per_K2 * 1e-3 * warm_K * warm_K;
  }
  tip += changes_.warm_payload_m_per_K_kg * row.payload_kg *
         (row.temp_C - cell_.reference_temperature_C);
  for (const Changes::Frame& frame : changes_.frames) {
    if (frame.session.empty() || frame.session == row.session) tip += frame.tip_m;
  }
  for (const Changes::Step& step : changes_.steps) {
    if (step.of_tool && row.t_s >= step.time_s) tip += step.xyz_m;
  }
  return (1.0 + changes_.scale) * Seen(row, flange.Point(tip));
}

Eigen::VectorXd Arm::Torques(const Row& row) const {
  return Solve(row).torque_Nm;
}

Arm::Flange Arm::FlangeAt(const Row& row) const {
  const Posture posture = Solve(row);
  Flange flange;
  flange.origin_m = posture.flange.at;
  flange.axes << posture.flange.x, posture.flange.y, posture.flange.z;
  return flange;
}

double Arm::WorkOfGravity(const Row& row, const Eigen::VectorXd& s_rad) const {
  Posture posture;
  Place(row, s_rad, Vector3d::Zero(), posture);
  return posture.work_J;
}

std::vector<Vector3d> Tips(const Cell& cell, const Effects& effects, const std::vector<Row>& rows) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  std::vector<Vector3d> tips;
  tips.reserve(rows.size());
  for (const Row& row : rows) tips.push_back(arm.Tip(row));
  return tips;
}

}  // namespace simulator
