// The camera that the command line names.
#pragma once

#include <memory>
#include <string>

#include "drivers/camera/camera.h"
#include "firmware-like/result.h"

namespace CLI {
class App;
}

namespace plumbline {

struct LiveCameraOptions {
  std::string camera;  ///< device, serial number, or a recording
  std::string size;    ///< "1920x1080"; empty: the largest that is fast enough
  double rate_hz = 20;
  double exposure_ms = 0;  ///< this and the next two: 0 or -1, where not given
  double white_balance_K = 0;
  int gain_counts = -1, focus_counts = -1;
  bool fast = false, repeat = false;
};

/// Adds --camera and what belongs to it.
void AddCameraOptions(CLI::App& command, LiveCameraOptions& options);

/// A recording: a folder of images, or a sequence file (*.csv).
bool IsRecording(const std::string& camera);

Result<std::unique_ptr<Camera>> MakeLiveCamera(const LiveCameraOptions& options);

}  // namespace plumbline
