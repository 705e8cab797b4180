// Capabilities of a camera: its modes and controls.
#pragma once

#include <vector>

#include "drivers/camera/v4l2_controls.h"
#include "drivers/camera/v4l2_device.h"
#include "drivers/camera/v4l2_modes.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

struct V4l2Capabilities {
  std::vector<V4l2Mode> modes;
  std::vector<V4l2Control> controls;
};

/// Queries the device. Opens it briefly; does not disturb another program that is streaming from
/// it.
Result<V4l2Capabilities> QueryV4l2Capabilities(const V4l2Device& device);

}  // namespace plumbline::camera
