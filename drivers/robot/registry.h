// Registry of robot transports. To add one, add a line to the table in registry.cc.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "drivers/robot/modbus_client.h"
#include "drivers/robot/modbus_robot.h"
#include "drivers/robot/profile.h"
#include "drivers/robot/replay_robot.h"
#include "drivers/robot/robot.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

/// Settings of all transports; each uses its own part.
struct RobotConnection {
  TcpAddress tcp;
  SerialLine serial;
  int unit_id = 1;
  double timeout_s = 0.1;  ///< of a request and of the connection attempt
  RobotProfile profile;
  PushLimits push;
  ReplayRows replay;
  Clock clock = MonotonicSeconds;

  bool operator==(const RobotConnection&) const = default;
};

/// Creates a device for a transport: "tcp", "rtu", "replay". It is not connected yet; its first
/// Read() connects.
Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection);

}  // namespace plumbline::robot
