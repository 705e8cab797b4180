// Conversion of the configuration to the robot setup and the Modbus address ranges.
#pragma once

#include "app/base/config/daemon_config.h"
#include "drivers/modbus/register_image.h"

namespace plumbline::cell {

/// Everything that a robot link, and the push of points over it, is created from. If a reloaded
/// configuration has an equal setup, the running link is reused.
struct RobotSetup {
  std::string transport;
  robot::RobotConnection connection;  ///< including the rows of a replay
  std::vector<int> push_ids;

  bool operator==(const RobotSetup&) const = default;
};
/// Fails if a replay file has faults, which are logged.
Result<RobotSetup> RobotSetupFrom(const config::DaemonConfig& config);

/// The addresses of the register map that clients may read if there are this many points.
std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points);

/// The registers that clients may write, all zero.
modbus::CommandArea EmptyCommandArea();

}  // namespace plumbline::cell
