// Tags and bodies in the frames of a camera, one after the other.
#pragma once

#include <string>

#include "app/lens/lens_json.h"
#include "app/tracking/tracker.h"
#include "drivers/camera/camera.h"

namespace plumbline {

struct LiveTrackOptions {
  std::string lens_name;   ///< for messages
  int frames = 0;          ///< so many; 0: until the recording ends, or Ctrl-C
  bool json = false;       ///< a line of JSON for each frame; else a table
  bool recording = false;  ///< a camera that is not there at the beginning is waited for
};

/// Writes what is tracked to standard output, and once what goes wrong to standard error. Ctrl-C
/// ends it after the frame in work. @return the exit code
int TrackLive(Camera& camera, Tracker& tracker, const LensFile& lens,
              const LiveTrackOptions& options);

}  // namespace plumbline
