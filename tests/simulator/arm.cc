#include "tests/simulator/arm.h"

#include <Eigen/Geometry>
#include <cmath>

namespace simulator {

using Eigen::Vector3d;

/// A frame that moves along the arm by rotations and translations about its own axes.
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
  /// Rotates about its own origin by a rotation vector in its own axes.
  void Turn(const Vector3d& own_rad) {
    const Vector3d turn = own_rad.x() * x + own_rad.y() * y + own_rad.z() * z;
    const double angle = turn.norm();
    if (angle == 0.0) return;
    const Vector3d axis = turn / angle;
    for (Vector3d* v : {&x, &y, &z}) {
      *v = *v * std::cos(angle) + axis.cross(*v) * std::sin(angle) +
           axis * axis.dot(*v) * (1.0 - std::cos(angle));
    }
  }
  void Move(const Vector3d& own_m) { at = Point(own_m); }
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

/// Structural deflection of one joint's bearing and link in their own frames: at the start of the
/// axis, at the carriage of a prismatic joint, and at the end of the link.
struct Arm::Yields {
  Vector3d bearing_rad = Vector3d::Zero();
  Vector3d carriage_rad = Vector3d::Zero(), carriage_m = Vector3d::Zero();
  Vector3d end_rad = Vector3d::Zero(), end_m = Vector3d::Zero(), twist_rad = Vector3d::Zero();
};

struct Arm::Posture {
  /// Frames at the start of each joint axis (the flange last), and after each joint.
  std::vector<Walker> before, after;
  std::vector<double> mass_kg;         ///< outboard of each joint
  std::vector<Vector3d> first_moment;  ///< of that, kg m
  Vector3d base;
  Walker flange;
  Vector3d gravity;
  Vector3d base_moment_Nm;
  Eigen::VectorXd torque_Nm;
  double work_J;
  Eigen::VectorXd s_rad;
  Vector3d lean_rad;
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

Vector3d Slope(const Tool& tool, const Vector3d& g_F, double payload_kg, const Vector3d& cog_m) {
  if (tool.rigid) return Vector3d::Zero();
  const double length = tool.length_m;
  const double stiffness = tool.youngs_modulus_Pa * tool.SecondMomentM4();
  const Vector3d force = payload_kg * g_F;
  const Vector3d moment = (cog_m - Vector3d(0.0, 0.0, length)).cross(force);
  const Vector3d line_load = tool.density_kg_m3 * tool.AreaM2() * g_F;
  const double by_force = length * length / (2.0 * stiffness);
  const double by_moment = length / stiffness;
  const double by_weight = length * length * length / (6.0 * stiffness);
  return {-force.y() * by_force + moment.x() * by_moment - line_load.y() * by_weight,
          force.x() * by_force + moment.y() * by_moment + line_load.x() * by_weight, 0.0};
}

Vector3d Arm::Gravity() const {
  return Turned({changes_.gravity_rad.x(), changes_.gravity_rad.y(), 0.0}, cell_.gravity_m_s2);
}

double Arm::Payload(const Row& row) const {
  if (!cell_.payload_cog_m) return 0.0;
  return row.payload_kg * (1.0 + changes_.mass_scale) + changes_.mass_constant_kg;
}

namespace {

/// The walker at the end of a bent and twisted link.
template <typename Yields>
void EndLink(const Yields& yields, Walker& walker) {
  walker.Move(yields.end_m);
  walker.Turn(yields.end_rad);
  walker.Turn(yields.twist_rad);
}

}  // namespace

void Arm::Place(const Row& row, const Eigen::VectorXd& s_rad, const Vector3d& tilt_rad,
                Posture& posture, const std::vector<Yields>* yields) const {
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

  Vector3d stand(changes_.tilt_gain * row.tilt_rad.x(), changes_.tilt_gain * row.tilt_rad.y(), 0.0);
  for (const Changes::Tilt& event : changes_.tilts) {
    if (row.t_s >= event.time_s) stand.head<2>() += event.turn_rad;
  }
  const auto placed = [&](const Vector3d& v) {
    return Turned(tilt_rad, Turned(stand, RollPitchYaw(rpy, v)));
  };
  Walker walker{base, placed(Vector3d::UnitX()), placed(Vector3d::UnitY()),
                placed(Vector3d::UnitZ())};
  const int n = int(cell_.joints.size());
  const double growth = 1.0 + changes_.thermal_per_K * (row.temp_C - cell_.reference_temperature_C);
  std::vector<Vector3d> axis(n), point(n), centre(n);
  posture.before.resize(n + 1);
  posture.after.resize(n);
  posture.mass_kg.assign(n + 1, 0.0);
  posture.first_moment.assign(n + 1, Vector3d::Zero());
  for (int i = 0; i < n; ++i) {
    const Joint& joint = cell_.joints[i];
    const double count = joint.sign * (row.q_rad[i] + s_rad[i]);
    const double theta = (joint.prismatic ? 0.0 : count) + joint.offset_rad;
    double warm = growth;
    for (const Changes::Warmup& of : changes_.warmups) {
      if (of.joint == i) warm += of.growth * -std::expm1(-row.t_s / of.tau_s);
    }
    const double a = (joint.a_m + changes_.a_m[i]) * warm;
    const double d = (joint.d_m + changes_.d_m[i]) * warm + (joint.prismatic ? count : 0.0);
    const double alpha = joint.alpha_rad + changes_.alpha_rad[i];
    if (cell_.proximal) {
      walker.TurnAboutX(alpha);
      walker.at += a * walker.x;
      walker.TurnAboutY(changes_.beta_rad[i]);
      walker.at += d * walker.z;  // a link starts at the origin of its own frame
    }
    if (yields != nullptr && i > 0) EndLink((*yields)[i - 1], walker);
    if (yields != nullptr) walker.Turn((*yields)[i].bearing_rad);
    posture.before[i] = walker;
    axis[i] = joint.sign * walker.z;
    point[i] = walker.at;
    walker.TurnAboutZ(theta);
    if (!cell_.proximal) {
      walker.at += d * walker.z;
      walker.at += a * walker.x;
      walker.TurnAboutX(alpha);
      walker.TurnAboutY(changes_.beta_rad[i]);
    }
    if (yields != nullptr) {
      walker.Move((*yields)[i].carriage_m);
      walker.Turn((*yields)[i].carriage_rad);
    }
    posture.after[i] = walker;
    centre[i] = walker.Point(joint.com_m);
  }
  if (yields != nullptr) EndLink((*yields)[n - 1], walker);
  posture.before[n] = walker;

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
  posture.mass_kg[n] = mass;
  posture.first_moment[n] = first_moment;
  for (int i = n - 1; i >= 0; --i) {
    add(cell_.joints[i].mass_kg, centre[i]);
    posture.mass_kg[i] = mass;
    posture.first_moment[i] = first_moment;
    posture.torque_Nm[i] =
        cell_.joints[i].prismatic
            ? mass * axis[i].dot(posture.gravity)
            : axis[i].dot((first_moment - mass * point[i]).cross(posture.gravity));
  }
  if (row.tau_Nm.size() == n) posture.torque_Nm = row.tau_Nm;
  posture.base_moment_Nm = (first_moment - mass * base).cross(posture.gravity);
  posture.work_J = posture.gravity.dot(first_moment);
  if (n > 1) {
    posture.torque_Nm[1] +=
        changes_.counterbalance_Nm * std::sin(row.q_rad[1] + changes_.counterbalance_phase_rad);
  }
}

/// Rotation and displacement of the free end of a clamped rod under a force and a moment at that
/// end. All in one frame; `rod` is the vector along the rod and `soft` is 1 / (E I).
void BendRod(const Vector3d& rod, double soft, const Vector3d& force, const Vector3d& moment,
             Vector3d& turn, Vector3d& move) {
  const double length = rod.norm();
  if (length < 1e-6) return;
  const Vector3d e = rod / length;
  const Vector3d across = force - e * e.dot(force);
  const Vector3d bending = moment - e * e.dot(moment);
  turn += soft * (e.cross(across) * (length * length / 2.0) + bending * length);
  move += soft *
          (across * (length * length * length / 3.0) + bending.cross(e) * (length * length / 2.0));
}

/// Tilt of a carriage with play as a rotation in the axes of `carriage`: about each of two
/// axes across the travel by half its play times the sine of the angle whose tangent is the
/// moment divided by weight and half the carriage's length.
Vector3d TippedCarriage(const Walker& carriage, const Vector3d& travel, double play_x,
                        double play_y, double weight_N, const Vector3d& moment_Nm) {
  constexpr double kHalfLength_m = 0.025;
  const Vector3d sideways = travel.cross(carriage.x);
  const double bearing_Nm = weight_N * kHalfLength_m;
  const auto lies = [&](const Vector3d& about) {
    return std::sin(std::atan2(about.dot(moment_Nm), bearing_Nm));
  };
  return carriage.Into(play_x * lies(carriage.x) * carriage.x + play_y * lies(sideways) * sideways);
}

std::vector<Arm::Yields> Arm::YieldsOf(const Row& row, const Posture& posture) const {
  const int n = int(cell_.joints.size());
  std::vector<Yields> yields(n);
  const Vector3d& g = posture.gravity;
  const auto moment = [&](int beyond, const Vector3d& about) {
    return Vector3d((posture.first_moment[beyond] - posture.mass_kg[beyond] * about).cross(g));
  };
  for (int i = 0; i < n; ++i) {
    Yields& own = yields[i];
    const Walker& root = posture.before[i];
    const Walker& end = posture.before[i + 1];
    Vector3d borne = root.Into(moment(i, root.at));
    borne.z() = 0.0;
    own.bearing_rad = changes_.bearing[i] * borne;
    if (cell_.joints[i].prismatic) {
      const Walker& carriage = posture.after[i];
      const Vector3d rod = carriage.Into(cell_.joints[i].sign * row.q_rad[i] * root.z);
      BendRod(rod, changes_.axis_bending[i], carriage.Into(posture.mass_kg[i] * g),
              carriage.Into(moment(i, carriage.at)), own.carriage_rad, own.carriage_m);
      own.carriage_rad += TippedCarriage(carriage, root.z, changes_.guide_x[i], changes_.guide_y[i],
                                         posture.mass_kg[i] * g.norm(), moment(i, carriage.at));
    }
    const Vector3d rod = end.Into(end.at - root.at);
    const double length = rod.norm();
    if (length < 1e-6) continue;
    // A moment that varies linearly from joint to link end corresponds to one force.
    const Vector3d tip = end.Into(moment(i + 1, end.at));
    const Vector3d rise = end.Into(moment(i, root.at)) - tip;
    const Vector3d force = rise.cross(rod) / (length * length);
    BendRod(rod, changes_.link_bending[i] / length, force, tip, own.end_rad, own.end_m);
    own.twist_rad = changes_.link_torsion[i] * rod * rod.dot(tip) / (length * length);
  }
  return yields;
}

/// Sag due to unknown weight, evaluated in the commanded posture.
Eigen::VectorXd Arm::UnweighedSag(const Row& row) const {
  const int n = int(cell_.joints.size());
  Eigen::VectorXd sag = Eigen::VectorXd::Zero(n);
  if (changes_.sags.empty()) return sag;
  Posture still;
  Place(row, Eigen::VectorXd::Zero(n), Vector3d::Zero(), still);
  const Vector3d down = cell_.gravity_m_s2.normalized();
  for (const Changes::Sag& of : changes_.sags) {
    Walker link = still.before[of.link];
    const Joint& joint = cell_.joints[of.link];
    link.TurnAboutZ(joint.offset_rad + (joint.prismatic ? 0.0 : joint.sign * row.q_rad[of.link]));
    const Vector3d axis = cell_.joints[of.joint].sign * still.before[of.joint].z;
    sag[of.joint] += of.size_rad * axis.dot((of.across == 0 ? link.x : link.y).cross(down));
  }
  return sag;
}

Eigen::VectorXd Arm::Deflection(const Row& row, const Eigen::VectorXd& torque_Nm) const {
  const int n = int(cell_.joints.size());
  Eigen::VectorXd s = changes_.coupling * row.q_rad + UnweighedSag(row);
  const double longest = row.last_move_rad.cwiseAbs().maxCoeff();
  for (int i = 0; i < n; ++i) {
    const double tau = torque_Nm[i];
    const double compliance =
        cell_.joints[i].compliance_rad_per_Nm.value_or(0.0) + changes_.compliance[i];
    const double speed = longest > 0.0 ? row.last_move_rad[i] / longest : 0.0;
    s[i] +=
        compliance * tau + changes_.asymmetry[i] * std::abs(tau) -
        changes_.hardening[i] * tau * tau * tau + changes_.offset[i] +
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
  for (const Changes::Jump& jump : changes_.jumps) {
    if (row.t_s >= jump.time_s) s[jump.joint] += jump.by_rad;
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
  posture.s_rad = s;
  posture.lean_rad = tilt;
  return posture;
}

/// The flange after structural deflection of bearings, links and axes.
Walker Arm::Yielded(const Row& row, const Posture& solved) const {
  const auto yields = [](const Eigen::VectorXd& sizes) { return !sizes.isZero(0.0); };
  if (!yields(changes_.bearing) && !yields(changes_.link_bending) &&
      !yields(changes_.link_torsion) && !yields(changes_.axis_bending) &&
      !yields(changes_.guide_x) && !yields(changes_.guide_y)) {
    return solved.flange;
  }
  const std::vector<Yields> all = YieldsOf(row, solved);
  Posture moved;
  Place(row, solved.s_rad, solved.lean_rad, moved, &all);
  return moved.flange;
}

/// Direction and distance as reported by the erroneous camera.
Vector3d Arm::Seen(const Row& row, const Vector3d& p) const {
  if (!cell_.camera) return p;
  const Vector3d at = cell_.camera->at_m, rpy = cell_.camera->rpy_rad;
  const Vector3d ahead = RollPitchYaw(rpy, Vector3d::UnitZ());
  const double depth = ahead.dot(p - at);
  if (depth <= 0.0) return p;
  double zoomed = 1.0;  // 1 / this = true focal length / used focal length
  for (const Changes::Zoom& zoom : changes_.zooms) {
    if (row.t_s >= zoom.time_s) zoomed += zoom.stretch;
  }
  // On an image plane at focal length 1.
  const Vector3d across = (p - at) - depth * ahead;
  const double radius = across.norm() / depth;
  const double bent = changes_.lens_k1 * radius * radius;
  const double reported_depth = depth * zoomed * (1.0 - 2.0 * bent);
  // Position across the axis does not change with the zoom.
  const Vector3d reported_across = across * (1.0 - bent);
  return at + (1.0 + changes_.tag_size) * (reported_across + reported_depth * ahead);
}

double Arm::BendingFactor(const Row& row) const {
  return 1.0 + changes_.creep * std::log1p(row.t_s / changes_.creep_tau_s) +
         changes_.bending_per_kg * row.payload_kg;
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
    tip += Bending(tool, g, payload, cog) / (1.0 + changes_.tool_ratio) * BendingFactor(row);
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
  const Vector3d at = Seen(row, Yielded(row, posture).Point(tip));
  return cell_.anchor_m ? at : Vector3d((1.0 + changes_.scale) * at);
}

Eigen::Matrix3d Arm::TipAxes(const Row& row) const {
  const Posture posture = Solve(row);
  const Tool& tool = cell_.tool;
  Walker tip = Yielded(row, posture);
  if (!tool.rigid) {
    const Vector3d g = posture.flange.Into(posture.gravity);
    const double payload = Payload(row);
    const Vector3d cog =
        cell_.payload_cog_m ? Vector3d(*cell_.payload_cog_m + changes_.cog_m) : Vector3d::Zero();
    Vector3d root_moment = payload * cog.cross(g) +
                           tool.BodyMassKg() * Vector3d(0.0, 0.0, 0.5 * tool.length_m).cross(g);
    root_moment.z() = 0.0;
    tip.Turn(Slope(tool, g, payload, cog) / (1.0 + changes_.tool_ratio) * BendingFactor(row) +
             changes_.root_compliance * root_moment);
  }
  Eigen::Matrix3d axes;
  axes << tip.x, tip.y, tip.z;
  return axes;
}

double Arm::Range(const Vector3d& tip_m) const {
  const double length = (tip_m - *cell_.anchor_m - changes_.anchor_m).norm();
  return (1.0 + changes_.scale) * length + changes_.range_zero_m;
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

Eigen::VectorXd Readings(const Cell& cell, const Effects& effects, const std::vector<Row>& rows) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  const Eigen::Index axes = cell.anchor_m ? 1 : 3;
  Eigen::VectorXd readings(axes * Eigen::Index(rows.size()));
  for (Eigen::Index k = 0; k < Eigen::Index(rows.size()); ++k) {
    const Vector3d tip = arm.Tip(rows[std::size_t(k)]);
    if (cell.anchor_m) {
      readings[k] = arm.Range(tip) * 1e3;
    } else {
      readings.segment<3>(3 * k) = tip * 1e3;
    }
  }
  return readings;
}

std::vector<Vector3d> Tips(const Cell& cell, const Effects& effects, const std::vector<Row>& rows) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  std::vector<Vector3d> tips;
  tips.reserve(rows.size());
  for (const Row& row : rows) tips.push_back(arm.Tip(row));
  return tips;
}

std::vector<Eigen::Matrix3d> TipsAxes(const Cell& cell, const Effects& effects,
                                      const std::vector<Row>& rows) {
  const Changes changes(effects, int(cell.joints.size()));
  const Arm arm(cell, changes);
  std::vector<Eigen::Matrix3d> all;
  all.reserve(rows.size());
  for (const Row& row : rows) all.push_back(arm.TipAxes(row));
  return all;
}

}  // namespace simulator
