// Where the tool tip is wanted: the points that the daemon corrects.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// An assembly point: the pose that the *loaded* tool point shall reach.
struct AssemblyPoint {
  int id = 0;  ///< 1..65535, the number the PLC knows it by
  std::string name;
  Pose X_WP;                 ///< wanted pose of the tool point in W
  Vec3 p_TP = Vec3::Zero();  ///< tool point in the tip frame T [m]; it turns with the tip's slope
  bool orientation_free = false;      ///< only the position is wanted
  std::optional<JointVector> near_q;  ///< joints where it was taught: chooses the branch
  std::optional<double> payload_kg;   ///< carried there; absent: what the robot carries now
};

}  // namespace plumbline
