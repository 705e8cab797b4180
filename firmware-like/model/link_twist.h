// Constant rotation of a row of a Denavit-Hartenberg table.
#pragma once

#include "firmware-like/model/cell_model.h"

namespace plumbline::model {

/// Rx(alpha) Ry(beta) Rz(gamma): the rotation of a "dh" row after its joint; for an "mdh" row,
/// where gamma is 0, the rotation before its joint.
inline Mat3 LinkTwist(const Joint& joint) {
  return (Eigen::AngleAxisd(joint.alpha_rad, Vec3::UnitX()) *
          Eigen::AngleAxisd(joint.beta_rad, Vec3::UnitY()) *
          Eigen::AngleAxisd(joint.gamma_rad, Vec3::UnitZ()))
      .toRotationMatrix();
}

}  // namespace plumbline::model
