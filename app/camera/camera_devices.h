// The configured devices of one camera: the camera itself, its zoom sensor and its tag tracker.
#pragma once

#include <memory>

#include "app/config/camera_config.h"
#include "app/tracking/tracker.h"

namespace plumbline::camera {

struct CameraDevices {
  std::unique_ptr<Camera> camera;
  std::unique_ptr<zoom::ZoomSensor> zoom;
  std::unique_ptr<tracking::Tracker> tracker;
};

/// Creates the devices without connecting to them.
/// @return  an error that names the configuration key if one cannot be created
Result<CameraDevices> MakeCameraDevices(const config::CameraConfig& config,
                                        const config::TagsConfig& tags);

}  // namespace plumbline::camera
