// How far two models of a cell are apart.
#pragma once

#include <optional>
#include <string>
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

/// Poses all over the joint limits of a cell (an unlimited joint: half a turn or a metre to both
/// sides), the same ones each time; nothing carried.
std::vector<ModelPose> PosesWithinLimits(const CellModel& cell);

/// Why `to` is another arm than `from`: other joints, or a flange more than 50 mm from where the
/// same joint positions have it. An identification changes links by millimetres. Nothing where it
/// may be the same arm; tools, bases and effects are not compared.
std::optional<std::string> WhyAnotherArm(const CellModel& from, const CellModel& to);

}  // namespace plumbline
