#include "app/vision/camera/device_faults.h"

#include <fmt/format.h>

namespace plumbline::vision {

void DeviceFaults::OnSensor(zoom::ZoomResult result, std::string_view problem) {
  if (result == zoom::ZoomResult::kWaiting || sensor_ == result) return;
  if (result != zoom::ZoomResult::kOk) {
    sink_({log::Event::kSensorFault,
           fmt::format("zoom sensor: {}: {}", zoom::ZoomResultText(result), problem)});
  } else if (sensor_) {
    sink_({log::Event::kSensorBack, "zoom sensor responds again"});
  }
  sensor_ = result;
}

bool DeviceFaults::OnCamera(camera::CameraResult result, std::string_view problem, double now_s) {
  if (result == camera::CameraResult::kWaiting || result == camera::CameraResult::kNoFrame ||
      camera_ == result) {
    return false;
  }
  const bool ok = result == camera::CameraResult::kFrame;
  if (ok && camera_) {
    sink_({log::Event::kCameraBack,
           fmt::format("camera back after {:.1f} s", now_s - camera_lost_s_)});
  } else if (!ok) {
    if (!camera_ || *camera_ == camera::CameraResult::kFrame) camera_lost_s_ = now_s;
    sink_({result == camera::CameraResult::kEnded ? log::Event::kCameraEnded
                                                  : log::Event::kCameraLost,
           fmt::format("camera: {}: {}", camera::CameraResultText(result), problem)});
  }
  camera_ = result;
  return !ok;
}

void DeviceFaults::OnStore(const std::string& fault) {
  if (fault == store_) return;
  if (fault.empty()) {
    sink_({log::Event::kLensStoreWorks, "lens store works again"});
  } else {
    sink_({log::Event::kLensStoreFault, "lens store: " + fault});
  }
  store_ = fault;
}

}  // namespace plumbline::vision
