// A six-joint cell, and conditions in which everything is known.
#pragma once

#include "firmware-like/effects/influence.h"

namespace plumbline::effects {

inline model::CellModel SmallCell() {
  model::CellModel cell;
  for (int i = 0; i < 6; ++i) {
    model::Joint joint;
    joint.a_m = 0.1 * (i + 1);
    joint.d_m = 0.05 * (i + 2);
    cell.robot.joints.push_back(joint);
  }
  cell.measurement.reference_temperature_C = 20;
  cell.measurement.X_WC = Pose{};
  return cell;
}

/// Joint values are first, first + step, ..
inline model::JointVector Rising(double first, double step) {
  return model::JointVector(Eigen::VectorXd::LinSpaced(6, first, first + 5 * step));
}

inline Conditions KnownMoment() {
  Conditions moment = DeclaredConditions(SmallCell());
  moment.q = Rising(-1.0, 0.4);         // q3 = -0.2
  moment.qd = Rising(0.1, 0.2);         // qd3 = 0.5
  moment.qdd = Rising(-2, 1);           // qdd3 = 0
  moment.last_move = Rising(0.3, 0.1);  // of q3: 0.5
  moment.approach = Rising(1, 0);
  moment.approach[1] = -1;
  moment.approach[4] = 0;
  moment.tau = Rising(-30, 10);
  moment.payload_kg = 40;
  moment.t_s = 600;
  moment.temp_C = 25;
  moment.row = 7;
  moment.camera_name = "rear";
  moment.further = {{"air_hPa", 1013}, {"tilt_x_deg", 0.02}, {"tilt_y_deg", -0.01}};
  return moment;
}

}  // namespace plumbline::effects
