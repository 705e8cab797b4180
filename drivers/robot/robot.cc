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

}  // namespace plumbline::robot
