// Prior distributions for the deflection parameters that a cell does not declare.
#pragma once

#include <array>
#include <optional>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline::deflection {

/// A positive quantity known to an order of magnitude: its logarithm is normal.
struct LogNormal {
  double median = 0;
  double sigma_ln = 0;
};

/// Size and drive class of an arm, which determines the typical wind-up of its joints.
enum class ArmClass {
  kSmall,          ///< collaborative or small industrial arm, strain-wave gears
  kTorqueSensing,  ///< seven axes with joint torque sensors
  kMedium,         ///< cycloidal (RV) gears, about 15 to 80 kg
  kHeavy,          ///< cycloidal (RV) gears, above that
};

/// Priors of the parameters that a cell does not declare; entries of declared ones are empty.
///
/// Joint wind-up. theta is the wind-up of a joint under T, its largest gross gravity torque (rated
/// payload, any posture, no counterbalance). Its compliance is theta / T:
///   class            shoulder, elbow [mrad]   sigma of ln
///   small                 3.0                  0.46
///   torque sensing        7.0                  0.50
///   medium                2.2                  0.45
///   heavy                 2.8, 2.2             0.40
/// based on the published stiffness of a KR 10 class arm, Manutec r3, KR 240-2, KR 270 and KR 500
/// (Dumas et al. 2011; Klimchik et al. 2013; Modelica Standard Library, RobotR3) and on gear
/// catalogues (strain wave 1.3 to 1.7 mrad at rated torque, cycloidal 0.84 to 1.17). The difference
/// between arms and gears, a factor of about 1.5 to 2.5, is due to housings, bearings and links.
/// Joints that carry no gravity torque by design are related to the shoulder stiffness k_2:
///   first axis  1.0, 1.0, 0.6, 0.4 k_2 (small, torque sensing, medium, heavy), sigma of ln
///               0.42, 0.3, 0.5, 0.35
///   wrist       0.45, 0.7, 0.25, 0.1 k_2, sigma of ln 0.7, 0.35, 0.8, 0.87
/// The small wrist lies between the single identified arm (0.4 to 0.85) and the ratio of catalogue
/// gears of wrist and shoulder size (0.07 to 0.3). Half of the log variance of the class's shoulder
/// is common to all joints of an arm.
///
/// Rated payload. On arms from 5 to 500 kg, the payload's share of T_2 is 43 to 59 %: the rated
/// payload loads the shoulder of the stretched arm about as much as the links do. Without any link
/// mass, the rated payload is estimated from the reach R from shoulder to flange: 8 kg (R / m)^1.8
/// up to 1.5 m and 16.6 kg (R / 1.5 m)^4.5 beyond, fitted to manufacturers' data sheets from 3 to
/// 500 kg; sigma of ln 0.4.
///
/// Undeclared link masses: 30, 35, 20 and 15 % of the arm in base, upper arm, forearm and wrist,
/// sigma of ln 0.35; centre at half the length of the link, with a standard deviation of a fifth of
/// the length.
///
/// Tool root: the coupling tilts by 0.5 mrad under the moment it is sized for, sigma of ln 0.7.
/// Pedestal: 3e6, 3e7, 1e8 N m/rad for small, medium and heavy arms, sigma of ln 1.2, 1.2, 0.8. A
/// table or profile stand has 5e5 (1e5 to 2.6e6), a steel riser 1e7, a floor plate 1e8; cells do
/// not state which of these they have.
struct DeflectionPriors {
  ArmClass arm_class = ArmClass::kSmall;
  double rated_payload_kg = 0;
  /// Of the rated payload. If not 0, all link masses scale with the rated payload, and all
  /// compliances inversely.
  double rated_sigma_ln = 0;
  int shoulder = 0;  ///< index of the joint that lifts the arm
  /// False if an error source has no prior: a prismatic axis that carries weight, or an arm without
  /// a joint that lifts it (SCARA, gantry), whose links and bearings bend instead.
  bool complete = true;

  /// [rad/(N m)]; empty if declared by the cell or by one of its effects, or if prismatic.
  std::array<std::optional<LogNormal>, model::kMaxJoints> compliance;
  double common_sigma_ln = 0;  ///< part of every compliance's sigma_ln that is common to the arm

  struct Link {
    double mass_kg = 0;            ///< declared, or the median
    double mass_sigma_ln = 0;      ///< 0: declared
    Vec3 com_L = Vec3::Zero();     ///< centre of mass in the link's DH frame [m]
    Vec3 com_sd_L = Vec3::Zero();  ///< its standard deviation, along one direction [m]
    /// com_L minus the centre that the model assumes for a mass declared without a centre [m].
    Vec3 com_shift_L = Vec3::Zero();
  };
  std::array<Link, model::kMaxJoints> links;

  std::optional<LogNormal> root_tilt_rad;  ///< under the moment that the coupling is sized for
  std::optional<LogNormal> base_compliance_rad_per_Nm;
};

/// Determines the priors of a cell. Samples 400 postures; not for the control cycle.
DeflectionPriors PriorsOf(const model::CellModel& cell, const LoadedArm& arm);

}  // namespace plumbline::deflection
