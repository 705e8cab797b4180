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
#include "drivers/robot/rtde_robot.h"
#include "firmware-like/result.h"

namespace plumbline::robot {

/// Settings of all transports; each uses its own part.
struct RobotConnection {
  TcpAddress tcp;
  SerialLine serial;
  int unit_id = 1;
  double timeout_s = 0.1;  ///< of a request and of the connection attempt
  RobotProfile profile;
  RtdeSettings rtde;
  PushLimits push;
  int pushed_points = 0;  ///< number of slots that Push() is going to use; RTDE only
  ReplayRows replay;
  Clock clock = MonotonicSeconds;

  bool operator==(const RobotConnection&) const = default;
};

/// What a link reads and takes, for the checks of a configuration.
struct RobotSignals {
  std::string source;    ///< "the profile NAME", "RTDE"
  std::string_view key;  ///< of [robot], which decides about it
  int joints = 0;
  bool payload_mass = false, tool_number = false, payload_item = false;
  int push_slots = 0;
};
RobotSignals SignalsOf(std::string_view transport, const RobotConnection& connection);

/// Creates a device for a transport: "tcp", "rtu", "rtde", "replay". It is not connected yet; its
/// first Read() connects.
Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection);

}  // namespace plumbline::robot
