// The cameras' watches as a part of the daemon.
#pragma once

#include <memory>
#include <vector>

#include "app/camera/camera_supervisor.h"
#include "app/config/daemon_config.h"
#include "app/daemon/lifeline.h"
#include "app/daemon/loop_link.h"
#include "app/daemon/view_side.h"

namespace plumbline {

/// A watch for each configured camera; none where none is configured.
class CameraSide {
 public:
  /// Starts nothing yet. @param link, view  outlive it: where each camera tells, and is shown
  /// @return  or why a camera's devices cannot be made
  static Result<std::unique_ptr<CameraSide>> Open(const DaemonConfig& config, LoopLink& link,
                                                  ViewSide& view);
  void Start();
  void Stop();
  void AddTo(Lifeline& lifeline) const;

 private:
  explicit CameraSide(const DaemonConfig& config);

  WatchStores stores_;
  struct Watched {
    std::string name;  ///< empty: it has none
    std::unique_ptr<CameraWatch> watch;
  };
  std::vector<Watched> cameras_;
};

/// Whether what the cameras' side was made of differs: it takes a restart.
bool CameraDiffers(const DaemonConfig& a, const DaemonConfig& b);

/// A line of the log as one of a camera's that has a name: "camera rear stale: ..", "camera rear:
/// zoom sensor: ..".
std::string LineOfCamera(const std::string& name, const std::string& text);

}  // namespace plumbline
