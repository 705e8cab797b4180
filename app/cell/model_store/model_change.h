// Difference between two models of a cell, as distances of their predicted tips.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// A pose at which the tip is predicted.
struct ModelPose {
  model::JointVector q;
  double payload_kg = 0;
  std::optional<double> t_s, temp_C;
  int tool = 0;  ///< index, see CellModel::ToolAt
};

/// Largest distance between the loaded tips that two models predict, over all poses [m], with base
/// and tip as for points (deflection::CellOfPoints).
/// @return  why a model cannot predict (link masses not declared, deflection does not converge)
Result<double> LargestTipChange(const model::CellModel& from, const model::CellModel& to,
                                const std::vector<ModelPose>& poses);

/// Pseudorandom poses within the joint limits of a cell (half a turn or a metre to both sides for
/// an unlimited joint), without payload, with the tools in turn. Every call returns the same poses.
std::vector<ModelPose> PosesWithinLimits(const model::CellModel& cell);

/// Why `to` describes a different arm than `from`: other joints, or a flange more than 50 mm away
/// for the same joint positions, whereas identification changes links by millimetres. nullopt if it
/// can be the same arm. Tools, bases and effects are not compared.
std::optional<std::string> DifferentArmReason(const model::CellModel& from,
                                              const model::CellModel& to);

}  // namespace plumbline::cell
