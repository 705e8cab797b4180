// Payloads that the robot reports now or has reported (registers, journal), for payload source
// "robot".
#pragma once

#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/cell/model_store/point_moves.h"

namespace plumbline::cli {

/// The current payload, read from the registers of the daemon running on this computer, and the
/// smallest and largest payload in the newest rows of the journal. Sources that are not available
/// are skipped: no daemon, a port not given in the configuration, no journal. Takes at most a
/// second.
std::vector<cell::ReportedLoad> LoadsReportedByRobot(const config::DaemonConfig& config);

}  // namespace plumbline::cli
