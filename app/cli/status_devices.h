// Lines of `plumbline status` about cameras, gauges and virtual objects.
#pragma once

#include <ostream>
#include <string>

#include "app/cli/daemon_registers.h"

namespace plumbline::cli {

/// Lens and zoom, the board capture, the tracked bodies and the measured tip.
void PrintCamera(const DaemonRegisters& daemon, int camera, std::ostream& out);

/// Outcome of a gauge's latest press: "recorded", "not recorded: the robot is moving".
std::string GaugeOutcomeText(const DaemonRegisters& daemon, int gauge);

/// "gauge dial: connected, waiting for a press, for 5 min; 1.2345 mm, 12 s ago, recorded".
void PrintGauge(const DaemonRegisters& daemon, int gauge, std::ostream& out);

/// The nearest pair of virtual objects; prints nothing if no scene was evaluated lately.
void PrintObjects(const DaemonRegisters& daemon, std::ostream& out);

}  // namespace plumbline::cli
