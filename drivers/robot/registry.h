// The kinds of robot link there are. A new kind is one line in the table of registry.cc.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot/modbus_client.h"
#include "drivers/robot/profile.h"
#include "drivers/robot/push_gate.h"
#include "drivers/robot/replay_robot.h"
#include "drivers/robot/robot.h"
#include "firmware-like/result.h"

namespace plumbline {

/// All that any kind may need; each takes its own.
struct RobotConnection {
  TcpAddress tcp;
  SerialLine serial;
  int unit_id = 1;
  double timeout_s = 0.1;  ///< of one request, and of the connection
  RobotProfile profile;
  PushLimits push;
  ReplayRows replay;
  Clock clock = MonotonicSeconds;

  bool operator==(const RobotConnection&) const = default;
};

/// "tcp", "rtu", "replay".
std::vector<std::string_view> RobotTransports();

/// A device that is not connected yet; its first Read() connects.
Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection);

}  // namespace plumbline
