// A measured point with the conditions recorded at the same time.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"

namespace plumbline::model {

/// Used by the cycle's probes, the journal, tables and the diagnosis; in SI units. Values that were
/// not recorded are absent (joint vectors and names: empty), never zero. W is the instrument's
/// frame.
struct MeasuredPoint {
  std::optional<double> t_s;         ///< time since an origin chosen by the source
  JointVector q;                     ///< reported by the controller [rad] or [m]
  JointVector qd;                    ///< [rad/s] or [m/s]
  JointVector qdd;                   ///< [rad/s^2] or [m/s^2]
  JointVector tau;                   ///< measured [N m] or [N]
  std::optional<double> q_step_rad;  ///< resolution of the registers q was read from; 0: negligible
  std::optional<double> payload_kg;
  std::optional<int> tool_number{};   ///< number of the mounted tool
  std::optional<int> payload_item{};  ///< number of the payload item carried in addition; 0: none
  std::optional<double> temp_C;
  std::optional<Vec3> measured_W;    ///< tip [m]
  std::optional<Mat3> covariance_W;  ///< of measured_W [m^2]
  std::optional<double> range_m;     ///< distance from the anchor, or from `artefact`, to the tip
  std::optional<Eigen::Quaterniond> orientation_W;  ///< of the tip, unit length
  std::string artefact;           ///< touched, or measured against (files.md); empty: none
  std::optional<double> gauge_m;  ///< reading of the dial gauge `artefact`
  std::optional<double> sigma_m;  ///< standard deviation of this point on one axis
  /// Cameras that measured it: "side", "side+rear" (their mean); empty if unnamed, or without a
  /// camera.
  std::string camera;
};

}  // namespace plumbline::model
