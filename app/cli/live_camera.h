// Command line options that select and configure a live camera or a recording.
#pragma once

#include <memory>
#include <string>

#include "drivers/camera/camera.h"
#include "firmware-like/result.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

struct LiveCameraOptions {
  std::string camera;  ///< device, serial number, or path of a recording
  std::string size;    ///< "1920x1080"; empty: the largest that reaches rate_hz
  double rate_hz = 20;
  double exposure_ms = 0;  ///< this and the next three: 0 or -1 if not given
  double white_balance_K = 0;
  int gain_counts = -1, focus_counts = -1;
  bool fast = false, repeat = false;
};

/// Adds --camera and the options that depend on it.
void AddCameraOptions(CLI::App& command, LiveCameraOptions& options);

/// True for a recording: a folder of images, or a sequence file (*.csv).
bool IsRecording(const std::string& camera);

Result<std::unique_ptr<camera::Camera>> MakeLiveCamera(const LiveCameraOptions& options);

}  // namespace plumbline::cli
