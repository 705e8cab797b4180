// Between the cycle and the camera's watch: what the PLC is told, and its wishes.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

#include "drivers/latest.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {

/// Nobody waits. The counts are raised by the cycle; the watch obeys when one has changed.
struct CameraLink {
  Latest<CameraStatus> told{
      2, CameraStatus()};  ///< written by the watch, read by the cycle and the view
  std::atomic<std::uint32_t> start_board{0}, cancel_board{0};
  std::atomic<double> temp_C{NAN};  ///< of the robot, by the cycle; NAN: not told
};

}  // namespace plumbline
