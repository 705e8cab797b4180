// Monitoring worker: records probes in the journal, watches for drift, starts the diagnosis.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <thread>

#include "app/base/config/daemon_config.h"
#include "app/base/log/log_entry.h"
#include "app/cell/daemon/cycle_mailboxes.h"
#include "app/cell/daemon/diagnosis_run.h"
#include "app/cell/daemon/monitored_journal.h"
#include "app/cell/daemon/state_storage.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::cell {

/// Background thread that takes probes from the control cycle and passes each to the monitored
/// journal; after a drift alarm it runs the diagnosis, stores the corrected model as a proposal,
/// and applies it if the configuration allows that.
class MonitoringWorker {
 public:
  /// @param reload   called from the thread when another model was applied, and when models can be
  ///                 stored again
  /// @param storage  polled by the thread; if nullptr, the directory is assumed to be writable
  MonitoringWorker(CycleMailboxes& mailboxes, log::LogSink sink, std::function<void()> reload,
                   StateStorage* storage = nullptr);
  ~MonitoringWorker();
  MonitoringWorker(const MonitoringWorker&) = delete;
  MonitoringWorker& operator=(const MonitoringWorker&) = delete;

  /// Sets the configuration and the models in force; before Start() and at every reload.
  void Configure(const config::DaemonConfig& config, const ModelState& models);
  void Start();
  /// Also stops a running diagnosis.
  void Stop();
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }

 private:
  struct Task {
    config::DaemonConfig config;
    ModelState models;
  };
  using Clock = std::chrono::steady_clock;

  void Run();
  void Reconfigure(Task task);
  void PollStorage();
  void FollowDecisions();
  void StartDiagnosisIfDue();
  void PollDiagnosis();
  void RefreshModels();
  void PublishStatus();
  void LogLostProbes();

  CycleMailboxes& mailboxes_;
  log::LogSink sink_;
  std::function<void()> reload_;
  StateStorage* const storage_;

  std::mutex mutex_;  ///< of next_ and stop_
  std::optional<Task> next_;
  bool stop_ = false;
  std::thread thread_;
  ThreadHeartbeat heartbeat_;

  // Used by the thread only.
  config::DaemonConfig config_;
  ModelState models_;
  MonitoredJournal journal_;
  std::optional<DiagnosisRun> diagnosis_;
  Clock::time_point models_read_, storage_polled_;
  bool diagnosis_failed_ = false;
  bool event_pending_ = false;  ///< an event could not be written, and remains in the queue
};

}  // namespace plumbline::cell
