// The configured points as `plumbline check` prints them: correction, radius and posture of each.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/config/point_solutions.h"

namespace plumbline {

/// At most 80 columns wide; names that are longer than their column are cut, in JSON they are
/// whole.
/// @param solutions  SolvePoints(config)
std::string PointTable(const MachineConfig& config, const std::vector<PointSolution>& solutions);

/// One object a point and payload, in mm, kg and deg.
nlohmann::json PointsJson(const MachineConfig& config, const std::vector<PointSolution>& solutions);

}  // namespace plumbline
