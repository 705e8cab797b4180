// Assembly point: a target pose for the loaded tool point.
#pragma once

#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"

namespace plumbline::correction {

struct AssemblyPoint {
  int id = 0;  ///< 1..65535; identifies the point to the PLC
  std::string name;
  Pose X_WP;                 ///< target pose of the loaded tool point in W
  Vec3 p_TP = Vec3::Zero();  ///< tool point in the tip frame T [m]; rotates with the loaded tip
  bool orientation_free = false;             ///< only the position matters
  std::optional<model::JointVector> near_q;  ///< taught joints [rad] or [m]; select the branch
  std::optional<double> payload_kg;  ///< payload at this point; if absent, the robot's present one
};

}  // namespace plumbline::correction
