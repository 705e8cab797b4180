#include "drivers/zoom/zoom.h"

namespace plumbline::zoom {

std::string_view ZoomResultText(ZoomResult result) {
  switch (result) {
    case ZoomResult::kOk:
      return "ok";
    case ZoomResult::kWaiting:
      return "not connected";
    case ZoomResult::kTimeout:
      return "no answer in time";
    case ZoomResult::kLost:
      return "connection lost";
    case ZoomResult::kProtocol:
      return "invalid answers";
    case ZoomResult::kRefused:
      return "rejected by the device";
  }
  return "unknown";
}

}  // namespace plumbline::zoom
