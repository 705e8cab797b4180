// Reload of the configuration while the daemon runs.
#pragma once

#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "app/cell/daemon/reporter.h"
#include "app/cell/daemon/running.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// Ids and names of the configured points, for the reporter.
std::vector<Reporter::PointName> PointNames(const config::DaemonConfig& config);

/// Logs which model is in force, and adds robot and model to the context of later entries.
void LogModel(const ConfigInForce& in_force);

/// Runs a task on a thread of its own. An exception that it throws becomes an error, and so does
/// the failure to start a thread. The future's destructor waits for the thread.
template <typename T>
std::future<Result<T>> RunOnThread(std::function<T()> task) {
  try {
    return std::async(std::launch::async, [task = std::move(task)]() -> Result<T> {
      try {
        return task();
      } catch (const std::exception& thrown) {
        return Error{thrown.what()};
      }
    });
  } catch (const std::exception& not_started) {
    std::promise<Result<T>> failed;
    failed.set_value(Error{not_started.what()});
    return failed.get_future();
  }
}

/// Reads the configuration when requested, and puts it in force once the branches of its taught
/// points are found. Until then, or if it is faulty, the previous one remains in force. Used by the
/// main thread; the files are read and checked by a thread of their own, since that may take longer
/// than the service manager's watchdog allows the main thread.
class Reloader {
 public:
  Reloader(Running& running, Reporter& reporter) : running_(running), reporter_(reporter) {}
  /// Waits for the reading thread, which abandons the check of a model: the service manager does
  /// not wait as long as that may take.
  ~Reloader() { stop_.request_stop(); }
  Reloader(const Reloader&) = delete;
  Reloader& operator=(const Reloader&) = delete;

  /// Reads the files, which replace a pending configuration unless that has waited for too long:
  /// otherwise frequent requests would postpone new points forever. If they are being read already,
  /// they are read once more afterwards.
  void Request();
  /// To be called every few milliseconds while pending().
  void Poll();
  bool pending() const { return reading_.valid() || pending_.has_value(); }

 private:
  /// A configuration whose point branches are still being searched.
  struct PendingReload {
    ConfigInForce in_force;
    std::unique_ptr<CycleParts> parts;
  };

  /// Changes nothing but the model store. Called by the reading thread, while the main thread
  /// replaces neither the cycle's parts nor running_.state.
  /// @param carried  the present payload, if it is known
  std::optional<PendingReload> Read(const std::optional<loads::Payload>& carried) const;
  /// Reads the configuration again if its model is refused and withdrawn.
  /// @param logged  the faults of `in_force`
  /// @return  nullopt if the model must not come into force, or a stop is requested
  std::optional<ConfigInForce> WithAcceptedModel(
      ConfigInForce in_force, const config::FaultList& logged,
      const std::optional<loads::Payload>& carried) const;
  void StartReading();
  /// Takes what was read.
  void FinishReading();
  void Finish();
  bool WaitedForTooLong() const;
  void PutInForce(PendingReload reload);
  /// Replaces the parts of the cycle; feeds the watchdog meanwhile, as the old robot link may take
  /// as long as its timeouts.
  void ReplaceParts(std::unique_ptr<CycleParts> parts);

  Running& running_;
  Reporter& reporter_;
  std::stop_source stop_;
  std::future<Result<std::optional<PendingReload>>> reading_;
  std::optional<PendingReload> pending_;
  double pending_since_s_ = 0;  ///< time of the first request that is not served yet
  bool reread_ = false;         ///< another request came while it was being read or is pending
};

}  // namespace plumbline::cell
