// Lock-free mailboxes between the control cycle and a camera's supervisor: status out, requests in.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

#include "drivers/latest.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::vision {

struct CameraLink {
  /// Written by the supervisor, read by the control cycle and the display.
  Latest<status::CameraStatus> status{2, status::CameraStatus()};
  /// Request counters: the cycle increments one, the supervisor handles the request when it sees
  /// the change.
  std::atomic<std::uint32_t> start_board{0}, cancel_board{0};
  std::atomic<double> temp_C{NAN};  ///< of the robot, written by the cycle; NAN: unknown
};

}  // namespace plumbline::vision
