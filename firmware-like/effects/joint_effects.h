// Effects of joints and their gears, at standstill.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "firmware-like/effects/contributions.h"
#include "firmware-like/model/link_twist.h"

namespace plumbline::effects {

/// Joint offset: a joint whose zero is not where the controller assumes.
/// s_i += value_i, the same in every posture   [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. Unit: rad; m for a prismatic joint. The first joint's offset acts like a
/// rotation of the base, the last one's like a rotation of the tool; neither is identifiable if
/// that frame is estimated too.
struct JointOffset : AddsFrom<Entries::kTurn> {
  static EffectTraits Traits() {
    return {
        .id = "joint_offset",
        .meaning = "the joint's zero position is off",
        .remedy = "master the joint again, or let the correction compensate for the offset",
        .formula = "s_i += v_i",
        .shown_by =
            "poses in which the other joints vary. The first joint's offset acts like a "
            "rotated base, the last one's like a rotated tool",
        .parameters = {{.name = "q#",
                        .unit = "rad",
                        .plausible = {-0.02, 0.02},
                        .prismatic_unit = "m",
                        .prismatic_plausible = {-0.02, 0.02}}},
        .needs = {},
        .confused_with = {"backlash", "gear_ratio", "link_geometry", "base_frame", "tool_frame"},
        .per_joint = true,
        .of_arm = true,
        .zero_mean_over_arms = true};
  }
};

/// Offset event: a joint whose zero jumps at one time, at a power cycle or in a collision.
/// From the event onwards (t_s >= time, or row number >= row, counted from 1):
///   s_i += value_i                                                          [rad], [m] if
///   prismatic
/// as joint_offset [Whitney, Lozinski & Rourke 1986] before and after the event. Causes: an encoder
/// whose battery-backed counter lost counts, a belt that skipped a tooth, a brake that slipped
/// while the drive was off. File units: s, 1, rad. Adds nothing if no event time is given or its
/// signal is unknown. Each jump is an effect of its own. If the frames of each session are
/// estimated, not identifiable for the first joint at a change of session. The event time has no
/// derivative and must be found by search.
struct OffsetEvent {
  enum Parameter { kTime, kRow, kJoint };

  static EffectTraits Traits() {
    return {
        .id = "offset_event",
        .meaning = "the joint's zero position jumped at one time: a power cycle, a collision",
        .remedy =
            "find out what happened at that time; check the encoder's battery and the brake, and "
            "master the joint again",
        .formula = "from the moment on, s_i += v_i",
        .shown_by = "the same poses repeated before and after the moment",
        .parameters = {{"time", "s", 1, {0, 1e7}, ParameterRole::kShape},
                       {"row", "1", 1, {1, 1e6}, ParameterRole::kShape},
                       {.name = "q#",
                        .unit = "rad",
                        .plausible = {-0.02, 0.02},
                        .prismatic_unit = "m",
                        .prismatic_plausible = {-0.02, 0.02}}},
        .needs = {},
        .confused_with = {"step_event", "tilt_event", "joint_offset", "thermal_drift"},
        .per_joint = true,
        .name = "a joint zero that jumped at one time"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!HasHappened(term, values, conditions)) return;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.spec == kJoint)
        influence.Joint(Influence<T>::kTurn, parameter.joint) += values[k];
    }
  }
};

/// Gear ratio error: a joint that turns by a constant fraction more or less than commanded.
/// s_i += value_i q_i, with the commanded q_i [rad]. Unit: 1. The true ratio is fixed by the tooth
/// counts, so a nonzero value indicates a wrong entry in the controller or a scale error of the
/// encoder; 5e-3 is a generous limit.
struct GearRatio {
  static EffectTraits Traits() {
    return {.id = "gear_ratio",
            .meaning = "the joint turns by a constant fraction more or less than commanded",
            .remedy =
                "check the joint's gear ratio in the controller; otherwise let the correction "
                "compensate for it",
            .formula = "s_i += v_i q_i",
            .shown_by = "a wide range of the joint's angle: the error grows in proportion to it",
            .sound_size = "0: the tooth counts fix the ratio",
            .parameters = {{"q#", "1", 1, {-5e-3, 5e-3}}},
            .needs = {},
            .confused_with = {"joint_offset", "gear_periodic", "counterbalance", "link_geometry",
                              "approach_lag"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    AddToJoints<T>(Influence<T>::kTurn, term, values, influence,
                   [&](int joint) { return conditions.q[joint]; });
  }
};

/// Axis coupling: a joint that turns along with a joint inboard of it.
/// The drive of an outer axis runs through the inner ones: bevel gears of a wrist, hollow shafts, a
/// parallelogram. If the controller's decoupling ratio is wrong by the value, joint i turns with
/// q_j, j < i:
///   s_i += value_ij q_j            [1], named q<i>_of_q<j>
/// [Spong, Hutchinson & Vidyasagar, Robot Modeling and Control, on remotely driven links]. Zero if
/// every inner joint is at its controller zero. If q_j hardly varies, equivalent to joint_offset.
struct AxisCoupling {
  static EffectTraits Traits() {
    return {.id = "axis_coupling",
            .meaning = "the joint turns slightly along with another one, through shared gears",
            .remedy =
                "check the coupling ratio of these axes in the controller; an axis that is coupled "
                "by design is declared in the cell, [[robot.coupling]] with joint, of and ratio; "
                "otherwise let the correction compensate for it",
            .formula = "s_i += v_ij q_j, j inboard of i",
            .shown_by = "the two joints turned independently of each other",
            .sound_size = "0: the tooth counts fix the ratio",
            .parameters = {{"q#_of_q#", "1", 1, {-0.02, 0.02}}},
            .needs = {},
            .confused_with = {"gear_ratio", "joint_offset", "link_geometry", "gear_periodic"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.of < 0) continue;
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * conditions.q[parameter.of];
    }
  }
};

/// Joint compliance: a joint that winds up under its gravity torque more or less than declared.
/// s_i += value_i tau_i, with tau_i the gravity torque about the joint, or the measured one if the
/// arm has torque sensors   [Spong 1987, J. Dyn. Syst. Meas. Control 109(4)]. Unit:
/// rad/(N m). For a prismatic joint m/N, with tau_i the weight along its axis: a spindle or belt
/// that stretches, 0.1 to 1000 N/um. Valid for a linear gearbox; see joint_hardening. The plausible
/// range includes negative values, for a declared compliance that is somewhat too large; the sum
/// with the declared one must stay positive.
struct JointCompliance : AddsFrom<Entries::kCompliance> {
  static EffectTraits Traits() {
    return {
        .id = "joint_compliance",
        .meaning = "the joint winds up under its gravity torque",
        .remedy =
            "a property of the gearbox: let the correction compensate for it; a sudden increase "
            "indicates wear",
        .formula = "s_i += v_i tau_i",
        .shown_by =
            "different torques on the joint: several payloads, arm stretched out and folded",
        .sound_size =
            "wind-up at the largest gravity torque: 2.2 to 3.2 mrad with cycloidal or "
            "strain wave gears [Dumas et al. 2011; Klimchik et al. 2013; makers' "
            "catalogues], about 7 mrad in arms with joint torque sensors",
        .parameters = {{.name = "q#",
                        .unit = "rad/(N m)",
                        .plausible = {-2e-5, 2e-4},
                        .prismatic_unit = "m/N",
                        .prismatic_plausible = {-1e-6, 1e-5}}},
        .needs = {Signal::kTorques},
        .confused_with = {"joint_hardening", "payload_mass", "payload_cog", "pedestal_compliance",
                          "link_geometry", "counterbalance", "backlash", "link_bending",
                          "bearing_tilt"},
        .per_joint = true,
        .adds_compliance = true,
        // Wind-up at the largest gravity torque: 2.2 to 3.2 mrad for arms with cycloidal or
        // strain wave gears [Dumas et al. 2011; Klimchik et al. 2013; makers' catalogues], 7 for
        // the softest class, arms with joint torque sensors, twice that the largest seen there.
        .largest_observed_rotation_rad = 7e-3,
        .of_arm = true};
  }
};

/// Compliance asymmetry: a joint that yields differently under loads of opposite directions.
/// s_i += value_i |tau_i|, so that its compliance is c + value under a positive gravity torque and
/// c - value under a negative one, with c that of joint_compliance: a worm or preloaded gears whose
/// flanks differ, a belt or brake that yields in one direction only (value = c or -c). The bilinear
/// spring of [Shaw & Holmes 1983, J. Sound Vib. 90(1)]. Unit: rad/(N m); m/N for a prismatic joint.
/// Valid while |value| <= c, as a passive joint yields in the direction of its load. While the
/// torque has one direction, equivalent to joint_compliance. Friction on arrivals from one side
/// looks alike.
struct ComplianceAsymmetry : AddsFrom<Entries::kLoadShare> {
  static EffectTraits Traits() {
    return {
        .id = "compliance_asymmetry",
        .meaning = "the joint yields more under a load in one direction than in the other",
        .remedy =
            "check gears, belt and brake for wear or lost preload; let the correction compensate "
            "for what remains",
        .formula = "s_i += v_i |tau_i|",
        .shown_by =
            "torques of both signs on the joint, each of several sizes; arrivals from both "
            "sides separate it from friction",
        .parameters = {{.name = "q#",
                        .unit = "rad/(N m)",
                        .plausible = {-1e-4, 1e-4},
                        .prismatic_unit = "m/N",
                        .prismatic_plausible = {-5e-6, 5e-6}}},
        .needs = {Signal::kTorques},
        .confused_with = {"joint_compliance", "backlash", "arrival_friction", "joint_hardening"},
        .per_joint = true,
        // Half of the largest wind-up, if a joint yields in one direction only: see
        // joint_compliance.
        .largest_observed_rotation_rad = 3.5e-3,
        .of_arm = true};
  }
};

/// Joint hardening: a joint that becomes stiffer as its torque grows.
/// s_i -= value_i tau_i^3, in addition to the linear compliance   [strain-wave gears: Tuttle 1992,
/// MIT AI-TR 1365]. Unit: rad/(N m)^3. Valid while value tau^2 is below a third of the compliance;
/// beyond that, the deflection would decrease under a growing load.
struct JointHardening : AddsFrom<Entries::kHardening> {
  static EffectTraits Traits() {
    return {.id = "joint_hardening",
            .meaning = "the joint's compliance decreases as its torque grows",
            .remedy = "a property of the gearbox: let the correction compensate for it",
            .formula = "s_i -= v_i tau_i^3",
            .shown_by =
                "at least three clearly different torques on the joint, near zero and near the "
                "largest",
            .sound_size =
                "the secant stiffness rises by at most 1.8 times from zero to rated torque "
                "[strain wave gears, Harmonic Drive CSF catalogue]",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)^3",
                            .plausible = {0, 1e-6},
                            .prismatic_unit = "m/N^3",
                            .prismatic_plausible = {0, 1e-6}}},
            .needs = {Signal::kTorques},
            .confused_with = {"joint_compliance", "backlash", "gear_periodic"},
            .per_joint = true,
            // The secant stiffness rises by at most 1.8 from zero to rated torque [K3/K1 of strain
            // wave gears, Harmonic Drive CSF catalogue]: less than half of the wind-up.
            .largest_observed_rotation_rad = 3.5e-3,
            .of_arm = true};
  }
};

/// Counterbalance: a balancing spring that the model lacks.
/// tau_i += amplitude sin(q_i + phase), a torque that moves the arm only through that joint's
/// compliance, declared or fitted. Units: N m, rad. An absent phase is 0. Cannot be separated from
/// gear_periodic with one cycle per turn. Valid for a spring or gas cylinder whose
/// lever is short compared with its length.
struct Counterbalance {
  enum Parameter { kAmplitude, kPhase };
  static constexpr model::Interval kCircle{-std::numbers::pi, std::numbers::pi};

  static EffectTraits Traits() {
    return {.id = "counterbalance",
            .meaning = "a balancing spring or cylinder loads the joint",
            .remedy =
                "check the cylinder's pressure or the spring; let the correction compensate for a "
                "constant one",
            .formula = "tau_i += amplitude sin(q_i + phase)",
            .shown_by =
                "a wide range of the joint's angle with several payloads. Not separable from "
                "one cycle per turn of gear_periodic over the same rows",
            .parameters = {{"q#_amplitude", "N m", 1, {-1e4, 1e4}},
                           {"q#_phase", "rad", 1, kCircle, ParameterRole::kShape}},
            .needs = {},
            .confused_with = {"gear_periodic", "joint_compliance", "gear_ratio", "payload_mass"},
            .per_joint = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    using std::sin;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (term.parameters[k].spec != kAmplitude) continue;
      const int joint = term.parameters[k].joint;
      const T phase = ValueOfSame(term, values, k, kPhase, T(0));
      influence.Joint(Influence<T>::kTorque, joint) += values[k] * sin(conditions.q[joint] + phase);
    }
  }
};

/// Backlash: play in a gearbox, taken up by gravity or by the last move.
/// value_i is half the gap [rad]   [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst.
/// Meas. Control 108(1)]. `by` states what holds the joint at one flank:
///   load  s_i += value_i sign(tau_i)
///   move  s_i += value_i sign(last nonzero move of joint i); nothing before the first one
/// As long as that sign does not change, equivalent to joint_offset. Not valid for torques near
/// zero, where the joint may lie anywhere in its gap.
struct Backlash {
  static EffectTraits Traits() {
    return {.id = "backlash",
            .meaning = "the joint's gearbox has play",
            .remedy = "approach from one side; have the gearbox adjusted if the gap grows",
            .formula = "s_i += v_i sign(tau_i), or v_i sign(last move of joint i)",
            .shown_by =
                "approaches from both sides, or torques of both signs. While the sign never "
                "changes it equals joint_offset",
            .sound_size =
                "gap, twice the value: below 3e-4 rad (1 arcmin) for cycloidal gears [Nabtesco "
                "RV catalogue], 3e-4 to 6e-4 rad for strain wave gears [Harmonic Drive]",
            .parameters = {{.name = "q#",
                            .unit = "rad",
                            .plausible = {-2e-3, 2e-3},
                            .prismatic_unit = "m",
                            .prismatic_plausible = {-2e-3, 2e-3},
                            .not_negative_with = "load"},
                           {.name = "by", .role = ParameterRole::kWord, .words = "load,move"}},
            .needs = {},
            .word_needs = {{"load", Signal::kTorques}, {"move", Signal::kOrder}},
            .confused_with = {"joint_offset", "approach_lag", "joint_compliance", "joint_hardening",
                              "latency"},
            .per_joint = true,
            // Lost motion and hysteresis: below 1 arcmin for cycloidal gears [Nabtesco RV
            // catalogue], 1 to 2 for strain wave gears [Harmonic Drive]. 2 arcmin.
            .largest_observed_rotation_rad = 6e-4,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    const bool by_move = term.word == "move";
    for (std::size_t k = 0; k < values.size(); ++k) {
      const int joint = term.parameters[k].joint;
      if (!by_move) {
        influence.Joint(Influence<T>::kLoadGap, joint) += values[k];
      } else if (conditions.approach.size() > joint) {
        influence.Joint(Influence<T>::kTurn, joint) += values[k] * conditions.approach[joint];
      }
    }
  }
};

/// Periodic gear error: transmission and encoder errors that repeat with the joint angle.
/// s_i += sum over terms of amplitude sin(cycles q_i + phase), with the commanded q_i in rad
/// [Whitney, Lozinski & Rourke 1986, J. Dyn. Syst. Meas. Control 108(1); strain-wave gears: Tuttle
/// 1992, MIT AI-TR 1365]. Units: rad, 1/turn, rad. The number of cycles need not be an integer; the
/// default is 1 cycle and phase 0. The parameters of the first term are named q1_amplitude etc.,
/// those of the second q1_2_amplitude etc. Equivalent to counterbalance at one cycle.
struct GearPeriodic {
  enum Parameter { kAmplitude, kCycles, kPhase, kOfOneTerm };
  static constexpr model::Interval kCircle{-std::numbers::pi, std::numbers::pi};
  // No wheel of a gear train turns slower than its joint. Below half a cycle per turn, a sine is
  // indistinguishable from an offset and a slope.
  static constexpr model::Interval kCycleRange{0.5, 400};

  static ParameterSpec Amplitude(std::string_view name) {
    return {.name = name,
            .unit = "rad",
            .plausible = {-2e-3, 2e-3},
            .prismatic_unit = "m",
            .prismatic_plausible = {-2e-3, 2e-3}};
  }
  /// For a prismatic joint: 2 pi divided by the period [rad/m].
  static ParameterSpec Cycles(std::string_view name) {
    return {.name = name,
            .unit = "1/turn",
            .plausible = kCycleRange,
            .role = ParameterRole::kShape,
            .prismatic_unit = "rad/m",
            .prismatic_plausible = kCycleRange};
  }

  static EffectTraits Traits() {
    return {.id = "gear_periodic",
            .meaning = "the joint's error repeats with its angle: gear, encoder or bearing",
            .remedy =
                "a property of gear or encoder: let the correction compensate for it; an increase "
                "indicates wear",
            .formula = "s_i += sum over terms of amplitude sin(cycles q_i + phase)",
            .shown_by =
                "many angles of the joint, not on a grid: equally spaced angles make several "
                "numbers of cycles look alike",
            .parameters = {Amplitude("q#_amplitude"),
                           Cycles("q#_cycles"),
                           {"q#_phase", "rad", 1, kCircle, ParameterRole::kShape},
                           Amplitude("q#_#_amplitude"),
                           Cycles("q#_#_cycles"),
                           {"q#_#_phase", "rad", 1, kCircle, ParameterRole::kShape}},
            .needs = {},
            .confused_with = {"counterbalance", "gear_ratio", "joint_offset", "joint_compliance"},
            .per_joint = true,
            .name = "periodic gear error"};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    using std::sin;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.spec % kOfOneTerm != kAmplitude) continue;
      const T cycles = ValueOfSame(term, values, k, parameter.spec + kCycles, T(1));
      const T phase = ValueOfSame(term, values, k, parameter.spec + kPhase, T(0));
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * sin(cycles * conditions.q[parameter.joint] + phase);
    }
  }
};

/// For each link, the frame that rotates with its joint, with z along the joint's axis, in B.
void TurnedFrames(const model::Robot& robot, const model::JointVector& drives,
                  std::array<Mat3, model::kMaxJoints>& R_BK) {
  const model::JointVector axes = model::AxesFromDrives(robot.couplings, drives);
  Mat3 R = Mat3::Identity();
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    const model::Joint& joint = robot.joints[k];
    const bool turns = joint.type == model::JointType::kRevolute;
    const double count = turns ? joint.sign * axes[static_cast<Eigen::Index>(k)] : 0;
    const Mat3 turn =
        Eigen::AngleAxisd(joint.theta_offset_rad + count, Vec3::UnitZ()).toRotationMatrix();
    const Mat3 twist = model::LinkTwist(joint);
    if (robot.convention == model::DhConvention::kProximal) {
      R_BK[k] = R * twist * turn;
      R = R_BK[k];
    } else {
      R_BK[k] = R * turn;
      R = R_BK[k] * twist;
    }
  }
}

/// Gravity sag: joint compliance under links of unknown mass.
/// For arms without declared link masses: the torque of an unknown weight, expressed by its gravity
/// regressors. With z_i the joint's axis, g gravity and a_k one of the two directions perpendicular
/// to the axis of joint k that rotate with its link,
///   s_i += q<i> tau_i + sum_{k >= i} q<i>_link<k>_a  z_i . (a_k x g) / |g|
/// with z_i + ratio z_j in place of z_i, from link j on, if its drive also turns axis j.
/// q<i> [rad/(N m)] is the compliance and tau_i the torque of everything declared (tool, payload,
/// links with a mass). q<i>_link<k>_x and _y [rad] are that compliance times the first moment of
/// the weight along a_k, of link k and everything it carries. x and y are the axes of the link's
/// frame after rotation of joint k and before the twist alpha ("dh"), or of its own frame ("mdh").
/// The component along the joint's axis is attributed to the previous link [Atkeson, An &
/// Hollerbach 1986, Int. J. Robot. Res. 5(3); Khalil & Dombre 2002, Modeling, Identification and
/// Control of Robots, ch. 9]. Frames are evaluated at the commanded joints; the error is of second
/// order in the sag. Revolute joints only. The first moment of links beyond a prismatic joint
/// changes with that joint, which is not modelled.
struct GravitySag {
  enum Parameter { kCompliance, kAcrossX, kAcrossY };

  static EffectTraits Traits() {
    return {.id = "gravity_sag",
            .meaning = "the joint winds up under its gravity torque; the links' masses are unknown",
            .remedy =
                "a property of the gearbox: let the correction compensate for it; declare "
                "link_mass_kg and link_com_mm to separate compliance from weight",
            .formula = "s_i += q_i tau_i + sum over k >= i of q_i_link_k_a  z_i . (a_k x g) / |g|",
            .shown_by =
                "as joint_compliance; separated from one cycle per turn of the same joint if "
                "another joint outboard moved, or with another payload",
            .sound_size = "as joint_compliance",
            .parameters = {{.name = "q#",
                            .unit = "rad/(N m)",
                            .plausible = {0, 2e-4},
                            .only = model::JointType::kRevolute},
                           {.name = "q#_link#_x",
                            .unit = "rad",
                            .plausible = {-0.05, 0.05},
                            .only = model::JointType::kRevolute},
                           {.name = "q#_link#_y",
                            .unit = "rad",
                            .plausible = {-0.05, 0.05},
                            .only = model::JointType::kRevolute}},
            .needs = {Signal::kNoTorques},
            .confused_with = {"gear_periodic", "counterbalance", "joint_offset", "link_geometry",
                              "gear_ratio"},
            .per_joint = true,
            .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm& term, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.robot || conditions.q.size() != conditions.robot->size()) return;
    std::array<Mat3, model::kMaxJoints> R_BK;
    TurnedFrames(*conditions.robot, conditions.q, R_BK);
    const model::Robot& robot = *conditions.robot;
    const Vec3 down_B = robot.X_WB.R.transpose() * robot.g_W.normalized();
    for (std::size_t k = 0; k < values.size(); ++k) {
      const TermParameter& parameter = term.parameters[k];
      if (parameter.spec == kCompliance) {
        influence.Joint(Influence<T>::kCompliance, parameter.joint) += values[k];
        continue;
      }
      const auto joint = static_cast<std::size_t>(parameter.joint);
      const auto link = static_cast<std::size_t>(parameter.of);
      Vec3 axis_B = robot.joints[joint].sign * R_BK[joint].col(2);
      for (const model::JointCoupling& coupling : robot.couplings) {
        if (coupling.drive != model::CouplingDrive::kReading) continue;
        if (coupling.of != parameter.joint || coupling.joint > parameter.of) continue;
        const auto driven = static_cast<std::size_t>(coupling.joint);
        axis_B += coupling.ratio * robot.joints[driven].sign * R_BK[driven].col(2);
      }
      const Vec3 across_B = R_BK[link].col(parameter.spec - kAcrossX);
      influence.Joint(Influence<T>::kTurn, parameter.joint) +=
          values[k] * axis_B.dot(across_B.cross(down_B));
    }
  }
};

}  // namespace plumbline::effects
