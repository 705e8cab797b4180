// JSON output of `plumbline status`: the registers by their names in the register map.
#pragma once

#include <nlohmann/json.hpp>

#include "app/cli/daemon_registers.h"

namespace plumbline::cli {

/// Values in the units of the register map. Cameras, gauges and points are arrays; a gauge that has
/// sent no reading has no gauge_reading and no gauge_age.
nlohmann::json StatusJson(const DaemonRegisters& daemon);

}  // namespace plumbline::cli
