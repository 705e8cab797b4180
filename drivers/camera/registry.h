// Registry of camera kinds. To add one, add a line to the table in registry.cc.
#pragma once

#include <memory>
#include <string_view>

#include "drivers/camera/camera.h"
#include "drivers/camera/dv_stream_camera.h"
#include "drivers/camera/recorded_camera.h"
#include "drivers/camera/v4l2_camera.h"
#include "drivers/clock.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Settings of all kinds; each uses its own part.
struct CameraConnection {
  V4l2CameraOptions v4l2 = {};
  RecordedCameraOptions recorded = {};
  DvStreamOptions dv = {};
  Clock clock = MonotonicSeconds;
};

/// Creates a camera of a kind: "v4l2", "recorded", "dv". It is not connected yet; its first Read()
/// connects.
Result<std::unique_ptr<Camera>> MakeCamera(std::string_view kind,
                                           const CameraConnection& connection);

}  // namespace plumbline::camera
