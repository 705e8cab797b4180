// Tracking of tags and bodies in a camera stream, printed to standard output.
#pragma once

#include <string>

#include "app/vision/lens/lens_json.h"
#include "app/vision/tracking/tracker.h"
#include "drivers/camera/camera.h"

namespace plumbline::cli {

struct LiveTrackOptions {
  std::string lens_name;   ///< for messages
  int frames = 0;          ///< number of frames to track; 0: until the recording ends or Ctrl-C
  bool json = false;       ///< print one line of JSON per frame instead of text
  bool recording = false;  ///< the camera is a recording; do not give up if no frame arrives
};

/// Prints the tracked tags and bodies to standard output, and each problem once to standard error.
/// Ctrl-C stops it after the current frame.
/// @return the exit code
int TrackLive(camera::Camera& camera, vision::Tracker& tracker, const vision::LensFile& lens,
              const LiveTrackOptions& options);

}  // namespace plumbline::cli
