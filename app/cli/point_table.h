// Table of the solved points, printed by `plumbline check`: correction, radius and posture.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/base/config/point_solutions.h"

namespace plumbline::cli {

/// At most 80 columns wide; long names are truncated.
/// @param solutions  from SolvePoints(config)
std::string PointTable(const MachineConfig& config,
                       const std::vector<config::PointSolution>& solutions);

/// One object per point and payload, in mm, kg and deg; names are not truncated.
nlohmann::json PointsJson(const MachineConfig& config,
                          const std::vector<config::PointSolution>& solutions);

}  // namespace plumbline::cli
