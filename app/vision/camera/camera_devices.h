// The configured devices of one camera: the camera itself, its zoom sensor and its tag tracker.
#pragma once

#include <memory>

#include "app/base/config/camera_config.h"
#include "app/vision/tracking/tracker.h"

namespace plumbline::vision {

struct CameraDevices {
  std::unique_ptr<camera::Camera> camera;
  std::unique_ptr<zoom::ZoomSensor> zoom;
  std::unique_ptr<Tracker> tracker;
};

/// Creates the devices without connecting to them.
/// @return  an error that names the configuration key if one cannot be created
Result<CameraDevices> MakeCameraDevices(const config::CameraConfig& config,
                                        const config::TagsConfig& tags);

}  // namespace plumbline::vision
