#include "drivers/robot/robot.h"

namespace plumbline::robot {

std::string_view LinkResultText(LinkResult result) {
  switch (result) {
    case LinkResult::kOk:
      return "ok";
    case LinkResult::kWaiting:
      return "not connected";
    case LinkResult::kTimeout:
      return "no response in time";
    case LinkResult::kLost:
      return "connection lost";
    case LinkResult::kProtocol:
      return "response does not match the request";
    case LinkResult::kException:
      return "rejected by the controller";
    case LinkResult::kTorn:
      return "registers refreshed during the reading";
    case LinkResult::kPushRefused:
      return "point not written";
    case LinkResult::kPushMismatch:
      return "written point reads back differently";
  }
  return "unknown";
}

std::string_view LinkRemedy(LinkResult result, std::string_view problem) {
  const auto says = [problem](std::string_view words) {
    return problem.find(words) != std::string_view::npos;
  };
  if (says("not known")) return "";  // the problem names the remedy
  if (says("Connection refused")) {
    return "check robot.host and robot.port, and switch the controller's Modbus server on";
  }
  if (says("No such file") || says("Permission denied")) {
    return "check robot.device, that the adapter is plugged in, and its permissions";
  }
  if (says("Illegal data address") || says("Illegal function") || says("Illegal data value")) {
    return "the controller has no such registers: check robot.profile, and the controller's model "
           "and its Modbus settings";
  }
  if (says("Gateway") || says("Target device")) {
    return "no controller answers to this unit id behind the gateway: check robot.unit_id";
  }
  switch (result) {
    case LinkResult::kException:
      return "the controller refuses the request: check its mode and its Modbus settings";
    case LinkResult::kTimeout:
      return "check the cable, robot.unit_id and that the controller is not overloaded; a slow one "
             "needs a larger robot.timeout_ms";
    case LinkResult::kProtocol:
      return "another program answers there, or several share the line: check robot.host, "
             "robot.port and robot.unit_id";
    default:
      return "check the cable, that the controller is on, and robot.host";
  }
}

}  // namespace plumbline::robot
