#include "drivers/robot/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/device_kinds.h"
#include "drivers/robot/modbus_robot.h"

namespace plumbline::robot {
namespace {

using Device = Result<std::unique_ptr<RobotDevice>>;

Device OverModbus(Result<ModbusClient> client, ReadPlan plan, const RobotConnection& connection) {
  if (!client) return client.failure();
  return ModbusRobot::Create(connection.profile, std::move(plan), std::move(client).value(),
                             connection.push, connection.clock);
}

Device MakeTcp(const RobotConnection& connection) {
  ReadPlan plan = PlanReading(connection.profile, false, connection.push.enabled);
  auto client = ModbusClient::Tcp(connection.tcp, connection.unit_id, connection.timeout_s,
                                  connection.clock, plan.markers);
  return OverModbus(std::move(client), std::move(plan), connection);
}

Device MakeRtu(const RobotConnection& connection) {
  const bool push = connection.push.enabled;
  if (const auto fault = SerialFault(connection.profile, push))
    return Error{fmt::format("robot profile \"{}\" {}", connection.profile.name, *fault)};
  ReadPlan plan = PlanReading(connection.profile, true, push);
  auto client = ModbusClient::Rtu(connection.serial, connection.unit_id, connection.timeout_s,
                                  connection.clock, plan.markers);
  return OverModbus(std::move(client), std::move(plan), connection);
}

Device MakeReplay(const RobotConnection& connection) {
  return ReplayRobot::Create(connection.replay, connection.clock);
}

Device MakeRtde(const RobotConnection& connection) {
  return RtdeRobot::Create(connection.tcp, connection.rtde, connection.timeout_s, connection.push,
                           connection.pushed_points, connection.clock);
}

constexpr DeviceKind<RobotDevice, RobotConnection> kKinds[] = {
    {"tcp", MakeTcp},
    {"rtu", MakeRtu},
    {"rtde", MakeRtde},
    {"replay", MakeReplay},
};

}  // namespace

RobotSignals SignalsOf(std::string_view transport, const RobotConnection& connection) {
  if (transport == "rtde") {
    const RtdeSettings& rtde = connection.rtde;
    const bool payload =
        std::find(rtde.fields.begin(), rtde.fields.end(), "payload") != rtde.fields.end();
    return {"RTDE",
            "transport",
            6,
            payload,
            rtde.tool_number_register.has_value(),
            rtde.payload_item_register.has_value(),
            rtde::SlotsOf(rtde.push)};
  }
  const RobotProfile& profile = connection.profile;
  return {fmt::format("the profile {}", profile.name),
          "profile",
          static_cast<int>(profile.joints.size()),
          profile.payload_mass.has_value(),
          profile.tool_number.has_value(),
          profile.payload_item.has_value(),
          profile.push ? profile.push->slots : 0};
}

Result<std::unique_ptr<RobotDevice>> MakeRobot(std::string_view transport,
                                               const RobotConnection& connection) {
  return MakeOfKind(kKinds, "robot transport", transport, connection);
}

}  // namespace plumbline::robot
