// Owner of the supervisors of all configured cameras.
#pragma once

#include <memory>
#include <vector>

#include "app/camera/camera_supervisor.h"
#include "app/config/daemon_config.h"
#include "app/daemon/cycle_mailboxes.h"
#include "app/daemon/display_feed.h"
#include "app/daemon/thread_watchdog.h"

namespace plumbline::daemon {

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

  camera::CameraStores stores_;
  struct Supervised {
    std::string name;  ///< empty: unnamed
    std::unique_ptr<camera::CameraSupervisor> supervisor;
  };
  std::vector<Supervised> cameras_;
};

/// Whether any setting differs that the supervisors are created from; such a change needs a
/// restart.
bool CamerasDiffer(const config::DaemonConfig& a, const config::DaemonConfig& b);

/// A log line with the name of its camera: "camera rear stale: ...", "camera rear: zoom sensor:
/// ...". Lines of an unnamed camera are returned unchanged.
std::string CameraLogLine(const std::string& name, const std::string& text);

}  // namespace plumbline::daemon
