// Which loads a robot is known to report, where the configuration leaves that to it.
#pragma once

#include <vector>

#include "app/config/daemon_config.h"
#include "app/model_store/point_moves.h"

namespace plumbline {

/// The load that the running daemon reads now, by its registers on this computer, and the least and
/// the greatest of the newest rows of the journal. What cannot be asked is left out: no daemon, a
/// port that is not in the configuration, no journal. Takes a second at most.
std::vector<ReportedLoad> LoadsOfRobot(const DaemonConfig& config);

}  // namespace plumbline
