#include "drivers/robot/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <utility>

#include "drivers/robot/modbus_robot.h"

namespace plumbline::robot {
namespace {

using Device = Result<std::unique_ptr<RobotDevice>>;

Device OverModbus(Result<ModbusClient> client, const RobotConnection& connection) {
  if (!client) return client.failure();
  return ModbusRobot::Create(connection.profile, std::move(client).value(), connection.push,
                             connection.clock);
}

Device MakeTcp(const RobotConnection& connection) {
  return OverModbus(
      ModbusClient::Tcp(connection.tcp, connection.unit_id, connection.timeout_s, connection.clock),
      connection);
}

Device MakeRtu(const RobotConnection& connection) {
  return OverModbus(ModbusClient::Rtu(connection.serial, connection.unit_id, connection.timeout_s,
                                      connection.clock),
                    connection);
}

Device MakeReplay(const RobotConnection& connection) {
  return ReplayRobot::Create(connection.replay, connection.clock);
}

struct Kind {
  std::string_view transport;
  Device (*make)(const RobotConnection&);
};

constexpr std::array<Kind, 3> kKinds = {{
    {"tcp", MakeTcp},
    {"rtu", MakeRtu},
    {"replay", MakeReplay},
}};

}  // namespace

std::vector<std::string_view> RobotTransports() {
  std::vector<std::string_view> transports;
  transports.reserve(kKinds.size());
  for (const Kind& kind : kKinds) transports.push_back(kind.transport);
  return transports;
}

Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection) {
  for (const Kind& kind : kKinds) {
    if (kind.transport == transport) return kind.make(connection);
  }
  return Error{fmt::format("robot transport \"{}\" is not one of {}", transport,
                           fmt::join(RobotTransports(), ", "))};
}

}  // namespace plumbline::robot
