// Probes into the journal, the drift monitor, the diagnosis, the proposal: beside the cycle.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <set>
#include <thread>

#include "app/config/daemon_config.h"
#include "app/daemon/diagnosis_run.h"
#include "app/daemon/loop_link.h"
#include "app/daemon/state_storage.h"
#include "app/journal/journal.h"
#include "app/log/log_entry.h"
#include "app/model_store/model_store.h"
#include "drivers/pulse.h"
#include "firmware-like/monitor/drift_monitor.h"

namespace plumbline {

/// One thread. It takes probes from the cycle, writes each to the journal and shows it to the
/// monitor; after an alarm it lets the diagnosis run, keeps the corrected model as a proposal, and
/// applies it where the configuration says so.
///
/// The monitor's state is not stored: at the start it is computed again from the journal's rows
/// since the model in force was applied, or since a person restarted it.
class LoopWorker {
 public:
  /// @param reload   called (from the thread) when another model was applied, and when models can
  ///                 be kept that could not
  /// @param storage  watched by the thread; nullptr: the directory is taken to work
  LoopWorker(LoopLink& link, LogSink sink, std::function<void()> reload,
             StateStorage* storage = nullptr);
  ~LoopWorker();
  LoopWorker(const LoopWorker&) = delete;
  LoopWorker& operator=(const LoopWorker&) = delete;

  /// The configuration and the models in force; before Start() and at every reload.
  void Configure(const DaemonConfig& config, const ModelState& models);
  void Start();
  /// Ends the diagnosis too.
  void Stop();
  const Pulse& pulse() const { return pulse_; }

 private:
  struct Task {
    DaemonConfig config;
    ModelState models;
  };
  using Clock = std::chrono::steady_clock;

  void Run();
  void TakeOver(Task task);
  void OpenJournal();
  Result<void> ReadJournal();
  void CloseJournal();
  void WatchStorage();
  void CheckStorage();
  bool Take(const LoopEvent& event);
  bool Record(const LoopEvent& event);
  void NewReference();
  bool IsOfReference(const JournalRow& row, bool replayed);
  bool RestartMonitor(const char* reason);
  void Judge(const JournalRow& row, bool replayed);
  void TellAlarm();
  void TellReference();
  void TellQuarantined(const JournalRow& row);
  void FollowDecisions();
  Vec3 ShiftOver(const DriftAlarm& alarm);
  void ConsiderDiagnosis();
  void WatchDiagnosis();
  void RefreshModels();
  void Tell();
  void TellLost();
  void LeaveMovedJournal();
  void Fail(const std::string& what);
  void Recovered();

  LoopLink& link_;
  LogSink sink_;
  std::function<void()> reload_;
  StateStorage* const storage_;

  std::mutex mutex_;  ///< of next_ and stop_
  std::optional<Task> next_;
  bool stop_ = false;
  std::thread thread_;
  Pulse pulse_;

  // The thread's own.
  DaemonConfig config_;
  ModelState models_;
  std::optional<Journal> journal_;
  std::optional<DriftMonitor> monitor_;
  std::optional<DiagnosisRun> diagnosis_;
  Clock::time_point journal_tried_, models_read_, decisions_read_, storage_watched_,
      storage_checked_;
  /// Whose probes the monitor compares: the marks' places err alike in each probe of one camera,
  /// otherwise in another's. Nothing: none was judged yet.
  std::optional<std::string> reference_camera_;
  std::set<std::string> passed_over_;  ///< cameras whose probes were told not to be judged
  std::vector<std::int64_t> judged_;   ///< rows that the monitor has seen, ascending
  /// Those of the start: a reload changes no camera.
  std::optional<std::vector<CameraConfig>> cameras_;
  bool alarm_handled_ = false;
  std::int64_t alarm_row_ = 0;
  bool alarm_new_ = false;  ///< found in rows that were accepted since, and not logged yet
  /// Of the journal: probes that wait for a person's decision, and the newest decision followed.
  std::int64_t waiting_ = 0, decision_ = 0;
  bool decided_ = false;         ///< a decision was found, and not logged: the journal is not read
  std::string decisions_fault_;  ///< why decisions could not be read; empty: they could
  bool quarantining_ = false;    ///< the newest probe was quarantined, and that was logged
  bool diagnosis_failed_ = false;
  std::string fault_;   ///< of the journal; empty: none
  bool waits_ = false;  ///< an event could not be written, and stands in the queue
  std::uint32_t recorded_ = 0;
  Vec3 last_residual_m_ = Vec3::Zero();
};

}  // namespace plumbline
