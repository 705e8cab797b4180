// Faults of a camera, its zoom sensor and the lens store; each change is logged once.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/log/log_entry.h"
#include "drivers/camera/camera.h"
#include "drivers/zoom/zoom.h"

namespace plumbline::vision {

class DeviceFaults {
 public:
  explicit DeviceFaults(log::LogSink sink) : sink_(std::move(sink)) {}

  /// Results that say nothing about the device (waiting, no new frame) are ignored.
  void OnSensor(zoom::ZoomResult result, std::string_view problem);
  /// @return  whether this result is a fault that the one before was not
  bool OnCamera(camera::CameraResult result, std::string_view problem, double now_s);
  /// @param fault  empty if the store works
  void OnStore(const std::string& fault);

  bool camera_lost() const { return camera_ != camera::CameraResult::kFrame; }
  bool store_fault() const { return !store_.empty(); }

 private:
  log::LogSink sink_;
  std::optional<camera::CameraResult> camera_;  ///< last logged result
  std::optional<zoom::ZoomResult> sensor_;      ///< last logged result
  double camera_lost_s_ = 0;
  std::string store_;
};

}  // namespace plumbline::vision
