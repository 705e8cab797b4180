// Lock-free mailboxes between the control cycle and a camera's watch: status out, requests in.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

#include "drivers/latest.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {

/// Nobody waits. The cycle raises the counts; the watch handles a request when one has changed.
struct CameraLink {
  /// Written by the watch, read by the cycle and the view.
  Latest<CameraStatus> status{2, CameraStatus()};
  std::atomic<std::uint32_t> start_board{0}, cancel_board{0};
  std::atomic<double> temp_C{NAN};  ///< of the robot, by the cycle; NAN: not known
};

}  // namespace plumbline
