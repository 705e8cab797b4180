// The devices of a camera that a configuration asks for: it, its zoom sensor, its tracker.
#pragma once

#include <memory>

#include "app/config/camera_config.h"
#include "app/tracking/tracker.h"

namespace plumbline {

struct CameraDevices {
  std::unique_ptr<Camera> camera;
  std::unique_ptr<ZoomSensor> zoom;
  std::unique_ptr<Tracker> tracker;
};

/// Connects nothing yet. @return  or what cannot be made, with the key that says so
Result<CameraDevices> CameraDevicesFrom(const CameraConfig& config, const TagsConfig& tags);

}  // namespace plumbline
