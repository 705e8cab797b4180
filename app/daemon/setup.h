// From the configuration to the parts of the daemon, where it is not one already.
#pragma once

#include "app/config/daemon_config.h"
#include "drivers/modbus/register_image.h"

namespace plumbline {

/// @return the device, or why it cannot be made (a replay file with faults, a bad setting)
Result<std::unique_ptr<RobotDevice>> RobotFrom(const DaemonConfig& config);

/// The addresses of the register map that may be read with this many points.
std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points);

/// The window that clients may write, all zero.
modbus::CommandArea EmptyCommandArea();

}  // namespace plumbline
