// The cameras of a moment, one by one: the only place here that knows how a state holds them.
#pragma once

#include <string>
#include <vector>

#include "app/view/shown.h"

namespace plumbline {

struct CameraFacts {
  std::string name;
  const ViewCamera* camera = nullptr;
  const PlcCamera* watch = nullptr;  ///< its zoom and its lens
  double images_per_s = 0;
};

/// Of the configured cameras; valid as long as `now` is. None where there is no state.
inline std::vector<CameraFacts> CamerasOf(const ShownNow& now) {
  if (!now.state || !now.state->watch.configured) return {};
  return {{"camera", &now.state->camera, &now.state->watch, now.frames_per_s}};
}

}  // namespace plumbline
