// Lines of `plumbline status`: a topic in the first column, then text; those about cameras, gauges
// and virtual objects.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>

#include "app/cli/daemon_registers.h"
#include "drivers/plc/register_map.h"

namespace plumbline::cli {

/// Prints "topic        text". An empty topic continues the topic of the line above.
void PrintStatusLine(std::ostream& out, std::string_view topic, std::string_view text);

/// "none", or "0x0041: nothing read from the robot, a point has no correction".
std::string BitsText(int word, std::span<const plc::BitMeaning> bits);

/// Lens and zoom, the board capture, the tracked bodies and the measured tip.
void PrintCamera(const DaemonRegisters& daemon, int camera, std::ostream& out);

/// Outcome of a gauge's latest press: "recorded", "not recorded: the robot is moving".
std::string GaugeOutcomeText(const DaemonRegisters& daemon, int gauge);

/// "gauge dial: connected, waiting for a press, for 5 min; 1.2345 mm, 12 s ago, recorded".
void PrintGauge(const DaemonRegisters& daemon, int gauge, std::ostream& out);

/// "motion link: correcting, 1.23 mm of 1.40 mm; 25000 answered, 0 lost"; prints nothing if it is
/// off.
void PrintMotionLink(const DaemonRegisters& daemon, std::ostream& out);

/// The nearest pair of virtual objects; prints nothing if no scene was evaluated lately.
void PrintObjects(const DaemonRegisters& daemon, std::ostream& out);

}  // namespace plumbline::cli
