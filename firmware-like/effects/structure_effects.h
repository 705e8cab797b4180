// Effects of the arm's structure: links, bearings, guides and the pedestal.
#pragma once

#include "firmware-like/effects/contributions.h"

namespace plumbline::effects {

/// Link geometry: links whose lengths or twists differ from the DH table.
/// a_i, d_i and alpha_i of the DH table are increased by their values   [Denavit & Hartenberg 1955,
/// J. Appl. Mech. 22; calibrated in this way by Nubiola & Bonev 2013, Robot. Comput.-Integr. Manuf.
/// 29(1)]. File units: mm, deg. If the axes of two successive joints are parallel,
/// their d have the same effect, and a small misalignment of the axes is not a small change of
/// alpha. Which parameters can be estimated follows from the rank of the data over the measured
/// poses.
struct LinkGeometry : AddsFrom<Entries::kLengthA> {
  static EffectTraits Traits() {
    return {.id = "link_geometry",
            .meaning = "the arm's links differ from the declared DH table",
            .remedy =
                "a property of this arm: let the correction compensate for it; a sudden change "
                "indicates a collision",
            .formula =
                "a_i, d_i, alpha_i and beta_i of the Denavit-Hartenberg table are increased by "
                "their values",
            .shown_by = "many different postures at constant load and temperature",
            .sound_size =
                "tip error of all geometry together, uncalibrated: 0.97 mm mean on an ABB IRB "
                "1600 [Nubiola & Bonev 2013]; calibrated by the maker: below 0.5 mm mean [Int. "
                "J. Adv. Manuf. Technol. 2022]; Universal Robots with nominal in place of "
                "factory values: up to 10 mm [Universal Robots ROS 2 driver, issue 28]",
            .parameters = {{"a#", "mm", 1e-3, {-5, 5}},
                           {"d#", "mm", 1e-3, {-5, 5}},
                           {"alpha#", "deg", kRadPerDeg, {-0.5, 0.5}},
                           {.name = "beta#",
                            .unit = "deg",
                            .to_SI = kRadPerDeg,
                            .plausible = {-0.5, 0.5},
                            .parallel_axes_only = true}},
            .needs = {},
            .confused_with = {"joint_offset", "thermal_growth", "measurement_scale", "base_frame",
                              "tool_frame", "joint_compliance"},
            .per_joint = true,
            .of_arm = true};
  }
};

/// Thermal growth: links that expand with temperature.
/// a_i and d_i are multiplied by 1 + alpha (T - T_ref), with T the row's temp_C and T_ref the
/// cell's reference temperature; centres of mass and the tool are unchanged. Unit:
/// 1/K. Steel 12e-6, aluminium 23e-6. Adds nothing if either temperature is unknown. Valid if the
/// whole arm is at the sensor's temperature.
struct ThermalGrowth {
  static EffectTraits Traits() {
    return {
        .id = "thermal_growth",
        .meaning = "the arm's links expand with temperature",
        .remedy = "provide the temperature to the daemon, or keep the cell's temperature constant",
        .formula = "a_i and d_i are multiplied by 1 + alpha (T - T_ref)",
        .shown_by = "temperatures that also fall, not only rise with time",
        .sound_size = "steel 12e-6, aluminium 23e-6 1/K",
        .parameters = {{"alpha", "1/K", 1, {0, 4e-5}}},
        .needs = {Signal::kTemperature},
        .confused_with = {"thermal_drift", "link_geometry", "measurement_scale"},
        .of_arm = true};
  }

  template <typename T>
  static void Add(const EffectTerm&, std::span<const T> values, const Conditions& conditions,
                  Influence<T>& influence) {
    if (!conditions.temp_C || !conditions.reference_temperature_C || !conditions.robot) return;
    const double warmer_K = *conditions.temp_C - *conditions.reference_temperature_C;
    for (const T& alpha : values) {
      int joint = 0;
      for (const model::Joint& link : conditions.robot->joints) {
        influence.Joint(Influence<T>::kLengthA, joint) += alpha * (warmer_K * link.a_m);
        influence.Joint(Influence<T>::kOffsetD, joint) += alpha * (warmer_K * link.d_m);
        ++joint;
      }
    }
  }
};

/// Pedestal compliance: a pedestal or floor that tilts under the arm.
/// The whole arm rotates about the base origin by value times the horizontal gravity moment of
/// links, tool body, mount and payload about that origin. Unit: rad/(N m). Valid for
/// a pedestal that is equally soft in both directions; an anchorage that lifts off is nonlinear and
/// not modelled.
struct PedestalCompliance : AddsFrom<Entries::kPedestalCompliance> {
  static EffectTraits Traits() {
    return {
        .id = "pedestal_compliance",
        .meaning = "the pedestal or the floor tilts as the arm reaches out",
        .remedy =
            "check the anchor bolts and the grout; otherwise let the correction compensate for it",
        .formula =
            "everything rotates about the base origin by v M, M the horizontal moment of "
            "links, tool and payload there",
        .shown_by =
            "the arm stretched out in different directions and folded, with several "
            "payloads",
        .sound_size =
            "floor plate 1e-8, steel riser 1e-7, table or profile stand 2e-6 rad/(N m) "
            "(engineering judgement)",
        .parameters = {{"compliance", "rad/(N m)", 1, {0, 1e-5}}},
        .needs = {Signal::kWeight},
        .confused_with = {"joint_compliance", "base_frame", "gravity_direction", "link_geometry",
                          "bearing_tilt", "link_bending"}};
  }
};

/// Bearing tilt: a joint bearing that tilts under the weight outboard of it.
/// Everything outboard of a revolute joint i rotates about the point o_i of its axis by
///   phi = value_i (M_i - axis (axis . M_i))             [rad/(N m)]
/// with M_i the moment of the outboard weight (links, tool, payload) about o_i. The bearing carries
/// the moment perpendicular to its axis; the moment along the axis acts on the drive, see
/// joint_compliance. [Harris & Kotzalas, Rolling Bearing Analysis, moment stiffness of four-point
/// and crossed roller bearings: 0.1 to 1000 kN m/mrad]. Valid for rotations of milliradians; the
/// torques of the other joints are computed without the tilt. Needs link masses. For the first
/// joint, identical to pedestal_compliance.
struct BearingTilt : AddsFrom<Entries::kBearing> {
  static EffectTraits Traits() {
    return {
        .id = "bearing_tilt",
        .meaning = "a joint's bearing tilts under the weight that it carries",
        .remedy =
            "a property of the bearing: let the correction compensate for it; a sudden increase "
            "indicates a worn or loose bearing",
        .formula = "everything beyond joint i rotates by v_i (M_i - axis (axis . M_i))",
        .shown_by =
            "loads to the side of the arm (a turned wrist, a load off its axis): the joint "
            "yields to the moment along its axis, the bearing to the moment across it",
        .sound_size = "2e-8 rad/(N m), an arm of the KUKA KR 240 class [Klimchik, thesis]",
        .parameters = {{.name = "q#",
                        .unit = "rad/(N m)",
                        .plausible = {0, 2e-5},
                        .only = model::JointType::kRevolute,
                        .not_of_first = true}},
        .needs = {Signal::kWeight},
        .confused_with = {"link_bending", "joint_compliance", "pedestal_compliance",
                          "link_geometry", "payload_cog", "tool_root_compliance", "tool_stiffness"},
        .per_joint = true,
        .of_arm = true};
  }
};

/// Link bending: links that bend and twist under the weight outboard of them.
/// Link i is a cantilever of length L along e, from the axis of joint i to that of the next joint
/// (the last link: to the flange). M_root is the moment of the weight outboard of joint i about the
/// start of the link, M_tip that of the weight beyond the link about its end. Everything beyond the
/// link moves by:
///   bending q<i> = L / (E I):   turn  v (M_root + M_tip)_perp / 2
///                               shift v L (M_root / 3 + M_tip / 6) x e
///   torsion q<i>_torsion = L / (G J):   turn v (e . M_tip) e          both [rad/(N m)]
/// [Gere & Timoshenko, Mechanics of Materials, ch. 9; in calibration: Dumas et al. 2011, Robot.
/// Comput.-Integr. Manuf. 27(4)]. The moment is assumed to vary linearly along the link, which is
/// exact except for the link's own weight. Valid for rotations of milliradians and a link of equal
/// stiffness in both directions; adds nothing if L is zero. Needs link masses.
struct LinkBending : AddsFrom<Entries::kLinkBending> {
  static EffectTraits Traits() {
    return {.id = "link_bending",
            .meaning = "a link bends or twists under the weight that it carries",
            .remedy = "a property of the arm's structure: let the correction compensate for it",
            .formula =
                "bending: rotation v_i (M_root + M_tip) / 2 across the link; torsion: rotation "
                "v_i_torsion M_tip along it",
            .shown_by =
                "loads to the side of the arm, and poses in which the link points in different "
                "directions; with parallel axes often not separable from the neighbouring "
                "bearings",
            .parameters = {{"q#", "rad/(N m)", 1, {0, 2e-5}},
                           {"q#_torsion", "rad/(N m)", 1, {0, 2e-5}}},
            .needs = {Signal::kWeight},
            .confused_with = {"joint_compliance", "bearing_tilt", "pedestal_compliance",
                              "link_geometry", "tool_stiffness"},
            .per_joint = true,
            .of_arm = true};
  }
};

/// Bending of the extending beam of a prismatic axis.
/// The beam of a prismatic joint i, extended by x = |q_i| along its axis u, bends under the weight
/// beyond it, with force F and moment M at the carriage (origin of the joint's frame):
///   turn  value (F x^2 / 2 + M x)_perp         where F x is short for x u x F
///   shift value (F x^3 / 3 + M x^2 / 2)_perp   [Gere & Timoshenko, Mechanics of Materials, ch. 9]
/// value = 1 / (E I) [1/(N m^2)]. Everything beyond the carriage moves with it. Valid for rotations
/// of milliradians and a beam of constant section that is clamped where q_i = 0. Needs link masses.
struct AxisBending : AddsFrom<Entries::kBearing> {
  static EffectTraits Traits() {
    return {.id = "axis_bending",
            .meaning = "an extending axis bends under its load, more so the further it is extended",
            .remedy =
                "a property of the axis: let the correction compensate for it; a sudden increase "
                "indicates a loose guide",
            .formula =
                "rotation v_i (F x^2 / 2 + M x), shift v_i (F x^3 / 3 + M x^2 / 2), x the "
                "extension of the axis",
            .shown_by = "different extensions, each with different payloads",
            .parameters = {{.name = "q#",
                            .unit = "1/(N m^2)",
                            .plausible = {0, 1e-3},
                            .only = model::JointType::kPrismatic}},
            .needs = {Signal::kWeight},
            .confused_with = {"joint_compliance", "link_bending", "gear_ratio", "link_geometry",
                              "bearing_tilt"},
            .per_joint = true,
            .of_arm = true};
  }
};

/// Guide play: a carriage of a prismatic axis that tilts in its guide.
/// The carriage of a prismatic joint i rests tilted in the play of its guide, on the side to which
/// the weight tips it. Everything beyond it rotates about the origin o_i of the joint's frame by
///   phi = x_i s(M . x_i) value_x + y_i s(M . y_i) value_y               [rad]
///   s(m) = m / sqrt(m^2 + (W h)^2)
/// with M the moment about o_i of the weight beyond, W the magnitude of that weight, x_i the x axis
/// of the joint's DH frame and y_i = travel x x_i, both perpendicular to the travel. A value is
/// half the angle between the two end positions: clearance divided by the length of the carriage.
///
/// Why s has a finite width: a carriage loaded by W at the lever m/W is supported at its two ends,
/// 2h apart, with W/2 (1 +- m/(W h))   [statics of a beam on two supports]. For |m| < W h both ends
/// stay on the guide and no play is taken up; beyond that, one end lifts and the carriage tilts
/// across the clearance. The rolling elements between the ends lift one after the other, so the
/// transition is smooth: s is odd, rises with m / (W h), and is 0.71 where the end lifts and 0.98
/// at five times that moment. h = 25 mm is an assumption, half the length of a single carriage. Two
/// carriages on a rail have a wider support, in which the play is taken up later than s predicts;
/// their play is not recognised if the loads lie within that range. `backlash` by load has no such
/// width, because a tooth bears on one flank only.
///
/// Valid for rotations of milliradians, for a carriage that travels with the joint's frame, and
/// under weight alone, without inertial loads. As long as no moment changes sign, this is nearly a
/// constant rotation, equivalent to link_geometry, joint_offset or base_frame. Needs link masses.
/// Plausible range: 0..2e-3 rad, an assumption (0.1 mm of clearance over 50 mm, as in a plain guide
/// before its gib is adjusted). A rolling guide with 5 um of clearance has 1e-4 rad, a preloaded
/// one has no play [classes: THK, Selecting a Radial Clearance].
struct GuidePlay : AddsFrom<Entries::kGuideTiltX> {
  static EffectTraits Traits() {
    return {.id = "guide_play",
            .meaning = "a sliding axis has play in its guide, and its load tips the carriage",
            .remedy =
                "adjust the preload of the carriage (gib, eccentric rollers), or replace it with "
                "one of a higher preload class",
            .formula =
                "rotation v m / sqrt(m^2 + (W h)^2) about x and y of the carriage, m the moment"
                " there, W the weight, h = 25 mm",
            .shown_by =
                "loads on both sides of the carriage, several on each: play is independent of "
                "the weight, compliance grows with it",
            .sound_size =
                "1e-4 rad with 5 um of clearance, 0 if preloaded [THK, Selecting a Radial "
                "Clearance]",
            .parameters = {{.name = "q#_x",
                            .unit = "rad",
                            .plausible = {0, 2e-3},
                            .only = model::JointType::kPrismatic},
                           {.name = "q#_y",
                            .unit = "rad",
                            .plausible = {0, 2e-3},
                            .only = model::JointType::kPrismatic}},
            .needs = {Signal::kWeight},
            .confused_with = {"axis_bending", "bearing_tilt", "backlash", "link_geometry",
                              "joint_offset", "base_frame", "link_bending", "pedestal_compliance"},
            .per_joint = true,
            .of_arm = true};
  }
};

}  // namespace plumbline::effects
