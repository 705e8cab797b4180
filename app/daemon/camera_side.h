// The camera's watch as a part of the daemon.
#pragma once

#include <memory>

#include "app/camera/camera_watch.h"
#include "app/config/daemon_config.h"
#include "app/daemon/view_side.h"

namespace plumbline {

/// The watch of the configured camera, not started; none where none is configured.
/// @param view  where its images are shown; it outlives the watch
/// @return  or why its devices cannot be made
Result<std::unique_ptr<CameraWatch>> CameraWatchFor(const DaemonConfig& config, CameraLink& link,
                                                    ViewSide& view);

/// Whether what the camera's side was made of differs: it takes a restart.
bool CameraDiffers(const DaemonConfig& a, const DaemonConfig& b);

}  // namespace plumbline
