// How far two models of a cell are apart.
#pragma once

#include <vector>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Where a model is asked for its tip.
struct ModelPose {
  std::string session;
  JointVector q;
  double payload_kg = 0;
  std::optional<double> t_s, temp_C;
};

/// Largest distance of the predicted loaded tips of two models over some poses [m].
/// @return why a model cannot predict (link masses not declared, no fixed point)
Result<double> LargestChange(const CellModel& from, const CellModel& to,
                             const std::vector<ModelPose>& poses);

}  // namespace plumbline
