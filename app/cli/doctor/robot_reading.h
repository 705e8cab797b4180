// A few readings of the robot, judged as the daemon judges them.
#pragma once

#include <memory>

#include "app/base/config/daemon_config.h"
#include "app/cli/doctor/examine.h"
#include "drivers/robot/registry.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// The robot as a reader beside the daemon sees it: it pushes nothing, so that it claims no input
/// of the controller.
Result<std::unique_ptr<robot::RobotDevice>> RobotToRead(const config::RobotLinkConfig& link);

/// Reads the robot until the daemon's own plausibility filter trusts it, for three seconds at most,
/// and shows every joint beside its limits. A fault if the filter does not trust the readings: a
/// robot that answers is not yet one whose registers are decoded rightly.
CheckResult CheckRobot(const config::DaemonConfig& config);

}  // namespace plumbline::cli
