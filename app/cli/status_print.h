// Output of `plumbline status` to be read: health, robot, model, devices and points.
#pragma once

#include <ostream>

#include "app/cli/daemon_registers.h"

namespace plumbline::cli {

/// One topic per line, in colours if the stream shows them.
void PrintStatus(const DaemonRegisters& daemon, std::ostream& out);

}  // namespace plumbline::cli
