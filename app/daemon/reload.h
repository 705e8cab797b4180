// Reload of the configuration while the daemon runs.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "app/daemon/reporter.h"
#include "app/daemon/running.h"

namespace plumbline::daemon {

/// Ids and names of the configured points, for the reporter.
std::vector<Reporter::PointName> PointNames(const config::DaemonConfig& config);

/// Logs which model is in force, and adds robot and model to the context of later entries.
void LogModel(const ConfigInForce& in_force);

/// Reads the configuration when requested, and puts it in force once the branches of its taught
/// points are found. Until then, or if it is faulty, the previous one remains in force. Used by the
/// main thread.
class Reloader {
 public:
  Reloader(Running& running, Reporter& reporter) : running_(running), reporter_(reporter) {}

  /// Reads the file, which replaces a pending configuration unless that has waited for too long:
  /// otherwise frequent requests would postpone new points forever.
  void Request();
  /// To be called every few milliseconds while pending().
  void Poll();
  bool pending() const { return pending_.has_value(); }

 private:
  /// A configuration whose point branches are still being searched.
  struct PendingReload {
    ConfigInForce in_force;
    std::unique_ptr<CycleParts> parts;
  };

  std::optional<PendingReload> Read() const;
  void ReadPending();
  /// See model_guard.h. Feeds the service manager's watchdog meanwhile.
  bool RefusesModel(const ConfigInForce& fresh) const;
  void PutInForce(PendingReload reload);
  /// Replaces the parts of the cycle; feeds the watchdog meanwhile, as the old robot link may take
  /// as long as its timeouts.
  void ReplaceParts(std::unique_ptr<CycleParts> parts);

  Running& running_;
  Reporter& reporter_;
  std::optional<PendingReload> pending_;
  double pending_since_s_ = 0;  ///< time of the first request that it serves
  bool reread_ = false;         ///< another request came, and the pending configuration goes first
};

}  // namespace plumbline::daemon
