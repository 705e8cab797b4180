// Per-camera view of a display status, shared by status.json and /metrics.
#pragma once

#include <string>
#include <vector>

#include "app/display/view/display_mailbox.h"

namespace plumbline::display {

struct CameraFacts {
  std::string name;
  const cell::ViewCamera* camera = nullptr;
  double images_per_s = 0;
};

/// The configured cameras; valid as long as `now`. Empty if there is no state.
inline std::vector<CameraFacts> CamerasOf(const display::DisplayStatus& now) {
  std::vector<CameraFacts> cameras;
  if (!now.state) return cameras;
  for (std::size_t k = 0; k < now.state->cameras.size(); ++k) {
    const cell::ViewCamera& camera = now.state->cameras[k];
    if (!camera.status.configured) continue;
    const std::string name = status::CameraNameText(camera.status.name);
    cameras.push_back({name.empty() ? "camera" : name, &camera,
                       k < now.frames_per_s.size() ? now.frames_per_s[k] : 0});
  }
  return cameras;
}

}  // namespace plumbline::display
