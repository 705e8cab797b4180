// Owner of the supervisors of all configured cameras.
#pragma once

#include <memory>
#include <vector>

#include "app/base/config/daemon_config.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "app/cell/daemon/display_feed.h"
#include "app/cell/daemon/thread_watchdog.h"
#include "app/vision/camera/camera_supervisor.h"

namespace plumbline::cell {

/// Owns one supervisor for each configured camera; does nothing if none is configured.
class CameraSupervisors {
 public:
  /// Creates the devices, but starts no thread.
  /// @param mailboxes, display  receive each camera's status and images; must outlive this object
  /// @return  the object, or why a camera's devices cannot be created
  static Result<std::unique_ptr<CameraSupervisors>> Open(const config::DaemonConfig& config,
                                                         CycleMailboxes& mailboxes,
                                                         DisplayFeed& display);
  void Start();
  void Stop();
  void AddTo(ThreadWatchdog& watchdog) const;

 private:
  explicit CameraSupervisors(const config::DaemonConfig& config);

  vision::CameraStores stores_;
  struct Supervised {
    std::string name;  ///< empty: unnamed
    std::unique_ptr<vision::CameraSupervisor> supervisor;
  };
  std::vector<Supervised> cameras_;
};

/// Whether any setting differs that the supervisors are created from; such a change needs a
/// restart.
bool CamerasDiffer(const config::DaemonConfig& a, const config::DaemonConfig& b);

/// A log line with the name of its camera: "camera rear stale: ...", "camera rear: zoom sensor:
/// ...". Lines of an unnamed camera are returned unchanged.
std::string CameraLogLine(const std::string& name, const std::string& text);

}  // namespace plumbline::cell
