// Postures and reported poses of the robot that a configuration names.
#pragma once

#include <functional>
#include <optional>

#include "app/base/config/daemon_config.h"
#include "app/measure/controller/controller_sample.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// Reads the robot until kUsualPostures postures are collected, which are spread as widely as the
/// robot moves, or the time is over.
/// @param moving    postures of the moving robot are used, too
/// @param tool      number of the mounted tool, in place of the robot's
/// @param progress  called with the share of the time and the number of postures; returns false to
///                  stop
/// @return          why the robot cannot be read, or reports no tool pose
Result<measure::ControllerSample> CollectPostures(
    const config::DaemonConfig& config, const model::CellModel& cell, double seconds, bool moving,
    std::optional<int> tool, const std::function<bool(double share, std::size_t kept)>& progress);

}  // namespace plumbline::cli
