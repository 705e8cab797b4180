// A few readings of the robot, judged as the daemon judges them.
#pragma once

#include "app/cli/doctor/examine.h"

namespace plumbline::cli {

/// Reads the robot until the daemon's own plausibility filter trusts it, for three seconds at most,
/// and shows every joint beside its limits. A fault if the filter does not trust the readings: a
/// robot that answers is not yet one whose registers are decoded rightly.
CheckResult CheckRobot(const config::DaemonConfig& config);

}  // namespace plumbline::cli
