// From the configuration to the parts of the daemon, where it is not one already.
#pragma once

#include "app/config/daemon_config.h"
#include "drivers/modbus/register_image.h"

namespace plumbline {

/// All that a robot link, and what is pushed over it, is made from. A configuration with an equal
/// one goes on with the link that runs.
struct RobotSetUp {
  std::string transport;
  RobotConnection connection;  ///< with the rows of a replay
  std::vector<int> push_ids;

  bool operator==(const RobotSetUp&) const = default;
};
/// @return why there is none: a replay file with faults
Result<RobotSetUp> RobotSetUpOf(const DaemonConfig& config);

/// The addresses of the register map that may be read with this many points.
std::shared_ptr<const modbus::AddressRanges> ReadableRanges(std::size_t points);

/// The window that clients may write, all zero.
modbus::CommandArea EmptyCommandArea();

}  // namespace plumbline
