#include "drivers/robot/registry.h"

#include <utility>

#include "drivers/device_kinds.h"
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

constexpr DeviceKind<RobotDevice, RobotConnection> kKinds[] = {
    {"tcp", MakeTcp},
    {"rtu", MakeRtu},
    {"replay", MakeReplay},
};

}  // namespace

Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection) {
  return MakeOfKind(kKinds, "robot transport", transport, connection);
}

}  // namespace plumbline::robot
