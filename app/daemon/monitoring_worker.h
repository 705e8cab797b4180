// Monitoring worker: records probes in the journal, watches for drift, starts the diagnosis.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <thread>

#include "app/config/daemon_config.h"
#include "app/daemon/cycle_mailboxes.h"
#include "app/daemon/diagnosis_run.h"
#include "app/daemon/row_drift_monitor.h"
#include "app/daemon/state_storage.h"
#include "app/journal/journal.h"
#include "app/log/log_entry.h"
#include "app/model_store/model_store.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::daemon {

/// Background thread that takes probes from the control cycle, writes each to the journal and
/// passes it to the drift monitor; after an alarm it runs the diagnosis, stores the corrected model
/// as a proposal, and applies it if the configuration allows that.
///
/// The drift monitor's state is not stored: at the start it is recomputed from the journal's rows
/// since the model in force was applied, or since a person restarted the monitor.
class MonitoringWorker {
 public:
  /// @param reload   called from the thread when another model was applied, and when models can be
  ///                 stored again
  /// @param storage  polled by the thread; nullptr: the directory is assumed to be writable
  MonitoringWorker(CycleMailboxes& mailboxes, log::LogSink sink, std::function<void()> reload,
                   StateStorage* storage = nullptr);
  ~MonitoringWorker();
  MonitoringWorker(const MonitoringWorker&) = delete;
  MonitoringWorker& operator=(const MonitoringWorker&) = delete;

  /// Sets the configuration and the models in force; before Start() and at every reload.
  void Configure(const config::DaemonConfig& config, const model_store::ModelState& models);
  void Start();
  /// Also stops a running diagnosis.
  void Stop();
  const ThreadHeartbeat& heartbeat() const { return heartbeat_; }

 private:
  struct Task {
    config::DaemonConfig config;
    model_store::ModelState models;
  };
  using Clock = std::chrono::steady_clock;

  void Run();
  void Reconfigure(Task task);
  void OpenJournal();
  Result<void> ReadJournal();
  void CloseJournal();
  void PollStorage();
  void CheckStorage();
  bool Handle(const CycleEvent& event);
  bool Record(const CycleEvent& event);
  bool RestartMonitor(const char* reason);
  void UpdateMonitor(const journal::JournalRow& row, bool replayed);
  void LogAlarm();
  void LogQuarantined(const journal::JournalRow& row);
  void FollowDecisions();
  void StartDiagnosisIfDue();
  void PollDiagnosis();
  void RefreshModels();
  void PublishStatus();
  void LogLostProbes();
  void CloseMovedJournal();
  void ReportFault(const std::string& what);
  void ReportRecovery();

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
  model_store::ModelState models_;
  std::optional<journal::Journal> journal_;
  std::optional<RowDriftMonitor> monitor_;
  std::optional<DiagnosisRun> diagnosis_;
  Clock::time_point journal_tried_, models_read_, decisions_read_, storage_polled_,
      storage_checked_;
  /// The cameras at the start: a reload does not change them.
  std::optional<std::vector<config::CameraConfig>> cameras_;
  bool alarm_handled_ = false;
  bool alarm_unlogged_ = false;     ///< raised by a reread row; not logged yet
  std::int64_t quarantined_ = 0;    ///< rows of the journal that await a person's decision
  std::int64_t last_decision_ = 0;  ///< id of the newest decision that was followed
  bool decision_unlogged_ = false;  ///< decision not logged yet: the journal must be reread first
  std::string decisions_fault_;     ///< why decisions cannot be read; empty: they can
  bool quarantining_ = false;       ///< the newest probe was quarantined, and that was logged
  bool diagnosis_failed_ = false;
  std::string fault_;           ///< of the journal; empty: none
  bool event_pending_ = false;  ///< an event could not be written, and remains in the queue
  std::uint32_t recorded_ = 0;
  Vec3 last_residual_m_ = Vec3::Zero();
};

}  // namespace plumbline::daemon
