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
    case LinkResult::kUnknownName:
      return "host name not known";
    case LinkResult::kRefused:
      return "connection refused";
    case LinkResult::kNoDevice:
      return "serial device not accessible";
    case LinkResult::kLost:
      return "connection lost";
    case LinkResult::kProtocol:
      return "response does not match the request";
    case LinkResult::kNoRegisters:
      return "registers rejected by the controller";
    case LinkResult::kNoUnit:
      return "unit id not reached";
    case LinkResult::kException:
      return "rejected by the controller";
    case LinkResult::kTorn:
      return "registers refreshed during the reading";
    case LinkResult::kNotAccepted:
      return "setup refused by the controller";
    case LinkResult::kPushRefused:
      return "point not written";
    case LinkResult::kPushMismatch:
      return "written point reads back differently";
  }
  return "unknown";
}

std::string_view LinkRemedy(LinkResult result) {
  switch (result) {
    case LinkResult::kTimeout:
      return "check the cable, robot.unit_id (Modbus) and that the controller is not overloaded; a "
             "slow one "
             "needs a larger robot.timeout_ms";
    case LinkResult::kRefused:
      return "check robot.host and robot.port, and switch the controller's Modbus or RTDE server "
             "on";
    case LinkResult::kNoDevice:
      return "check robot.device, that the adapter is plugged in, and its permissions";
    case LinkResult::kLost:
      return "check the cable and that the controller is on";
    case LinkResult::kNoRegisters:
      return "the controller has no such registers: check robot.profile, and the controller's "
             "model and its Modbus settings";
    case LinkResult::kNoUnit:
      return "no controller answers to this unit id behind the gateway: check robot.unit_id";
    case LinkResult::kException:
      return "the controller refuses the request: check its mode and its Modbus settings";
    case LinkResult::kOk:
    case LinkResult::kWaiting:
    case LinkResult::kUnknownName:
    case LinkResult::kProtocol:
    case LinkResult::kTorn:
    case LinkResult::kNotAccepted:
    case LinkResult::kPushRefused:
    case LinkResult::kPushMismatch:
      break;
  }
  return "";
}

bool IsException(LinkResult result) {
  return result == LinkResult::kNoRegisters || result == LinkResult::kNoUnit ||
         result == LinkResult::kException;
}

}  // namespace plumbline::robot
