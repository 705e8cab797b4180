// The cameras of a moment, one by one: the only place here that knows how a state holds them.
#pragma once

#include <string>
#include <vector>

#include "app/view/shown.h"

namespace plumbline {

struct CameraFacts {
  std::string name;
  const ViewCamera* camera = nullptr;  ///< with its watch: the zoom and the lens
  double images_per_s = 0;
};

/// Of the configured cameras; valid as long as `now` is. None where there is no state.
inline std::vector<CameraFacts> CamerasOf(const ShownNow& now) {
  std::vector<CameraFacts> cameras;
  if (!now.state) return cameras;
  for (std::size_t k = 0; k < now.state->cameras.size(); ++k) {
    const ViewCamera& camera = now.state->cameras[k];
    if (!camera.status.configured) continue;
    const std::string name = CameraNameText(camera.status.name);
    cameras.push_back({name.empty() ? "camera" : name, &camera,
                       k < now.frames_per_s.size() ? now.frames_per_s[k] : 0});
  }
  return cameras;
}

}  // namespace plumbline
