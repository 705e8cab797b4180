// From the configuration to the parts of the daemon.
#pragma once

#include "app/config/daemon_config.h"
#include "drivers/modbus/register_image.h"
#include "drivers/modbus/rtu_slave.h"
#include "drivers/modbus/tcp_server.h"
#include "drivers/plc/codec.h"
#include "drivers/robot/registry.h"
#include "firmware-like/machine.h"

namespace plumbline {

MachineConfig MachineConfigFrom(const DaemonConfig& config);

PlcConvention PlcConventionFrom(const PlcConfig& config);

/// @return the device, or why it cannot be made (a replay file with faults, a bad setting)
Result<std::unique_ptr<RobotDevice>> RobotFrom(const DaemonConfig& config);

modbus::TcpServerOptions TcpServerOptionsFrom(const PlcConfig& config);
modbus::RtuSlaveOptions RtuSlaveOptionsFrom(const PlcConfig& config);

/// The addresses of the register map that may be read with this many points.
std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points);

/// The window that clients may write, all zero.
modbus::CommandArea EmptyCommandArea();

}  // namespace plumbline
