// A few readings of the robot, judged as the daemon judges them.
#pragma once

#include <optional>

#include "app/cli/doctor/examine.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {

/// Reads the robot until the daemon's own plausibility filter trusts it, for three seconds at most,
/// and shows every joint beside its limits. A fault if the filter does not trust the readings: a
/// robot that answers is not yet one whose registers are decoded rightly.
CheckResult CheckRobot(const config::DaemonConfig& config);

/// What a few requests over a connection of its own say about a robot that a running daemon does
/// not trust: why it does not give its registers, or how its joints would be plausible. nullopt if
/// they say nothing that `fault` does not.
std::optional<CheckResult> ExamineRegisters(const config::DaemonConfig& config, InputFault fault);

}  // namespace plumbline::cli
