#include "drivers/camera/camera.h"

namespace plumbline::camera {

std::string_view CameraResultText(CameraResult result) {
  switch (result) {
    case CameraResult::kFrame:
      return "a frame";
    case CameraResult::kNoFrame:
      return "no frame in time";
    case CameraResult::kWaiting:
      return "not connected";
    case CameraResult::kLost:
      return "connection lost";
    case CameraResult::kUnusable:
      return "frames cannot be decoded";
    case CameraResult::kEnded:
      return "end of the recording";
  }
  return "unknown";
}

}  // namespace plumbline::camera
