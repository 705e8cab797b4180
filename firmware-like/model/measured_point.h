// A measured point of the cell with what was recorded of that moment.
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// In SI, from the probe of the cycle to the journal and to tables of measured points. What was not
/// recorded is absent (joint vectors: empty), never zero. Frame W is that of the instrument.
struct MeasuredPoint {
  std::optional<double> t_s;         ///< from whatever moment its source counts
  JointVector q;                     ///< as the controller counts them [rad] or [m]
  JointVector qd;                    ///< [rad/s] or [m/s]
  JointVector qdd;                   ///< [rad/s^2] or [m/s^2]
  JointVector tau;                   ///< measured [N m] or [N]
  std::optional<double> q_step_rad;  ///< step of the registers that q was read from; 0: fine
  std::optional<double> payload_kg;
  std::optional<double> temp_C;
  std::optional<Vec3> measured_W;                   ///< tip [m]
  std::optional<Mat3> covariance_W;                 ///< of measured_W [m^2]
  std::optional<double> range_m;                    ///< from the instrument's anchor to the tip
  std::optional<Eigen::Quaterniond> orientation_W;  ///< of the tip, unit length
};

}  // namespace plumbline
