#include "app/daemon/monitoring_worker.h"

#include <fmt/format.h>
#include <pthread.h>

#include <filesystem>

#include "app/daemon/probe_row.h"
#include "app/service/utc_clock.h"

namespace plumbline::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 200ms;  ///< if the cycle sends no event
constexpr auto kJournalRetry = 5s;
constexpr auto kStorageRetry = 2s;
constexpr auto kModelsRefresh = 1s;
constexpr auto kDecisionsRefresh = 1s;

}  // namespace

MonitoringWorker::MonitoringWorker(CycleMailboxes& mailboxes, log::LogSink sink,
                                   std::function<void()> reload, StateStorage* storage)
    : mailboxes_(mailboxes),
      sink_(std::move(sink)),
      reload_(std::move(reload)),
      storage_(storage) {}

MonitoringWorker::~MonitoringWorker() {
  Stop();
}

void MonitoringWorker::Configure(const config::DaemonConfig& config,
                                 const model_store::ModelState& models) {
  {
    const std::lock_guard lock(mutex_);
    next_ = Task{config, models};
  }
  mailboxes_.queue.Wake();
}

void MonitoringWorker::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "monitoring");
}

void MonitoringWorker::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  mailboxes_.queue.Wake();
  if (thread_.joinable()) thread_.join();
}

void MonitoringWorker::Run() {
  for (;;) {
    heartbeat_.Beat();
    mailboxes_.queue.Wait(kPeriod);
    std::optional<Task> task;
    bool stop = false;
    {
      const std::lock_guard lock(mutex_);
      std::swap(task, next_);
      stop = stop_;
    }
    if (task) Reconfigure(std::move(*task));
    PollStorage();
    if (config_.monitoring.enabled && !journal_ && Clock::now() - journal_tried_ > kJournalRetry) {
      OpenJournal();
    }
    event_pending_ = false;
    while (const CycleEvent* event = mailboxes_.queue.Front()) {
      event_pending_ = !Handle(*event);  // remains queued; further probes are refused meanwhile
      if (event_pending_) break;
      mailboxes_.queue.Pop();
      heartbeat_.Beat();
    }
    if (stop) break;
    // Each of these may wait for another program's lock on the journal or the models.
    heartbeat_.Beat();
    StartDiagnosisIfDue();
    heartbeat_.Beat();
    PollDiagnosis();
    heartbeat_.Beat();
    RefreshModels();
    heartbeat_.Beat();
    FollowDecisions();
    heartbeat_.Beat();
    CloseMovedJournal();
    PublishStatus();
  }
  CloseMovedJournal();
  LogLostProbes();
  diagnosis_.reset();
}

/// Logs probes that were acknowledged to the PLC, but could not be written before the shutdown.
void MonitoringWorker::LogLostProbes() {
  int probes = 0;
  for (; const CycleEvent* event = mailboxes_.queue.Front(); mailboxes_.queue.Pop()) {
    probes += event->monitor_restart ? 0 : 1;
  }
  if (probes == 0) return;
  sink_(
      {log::Event::kJournalFault,
       fmt::format("journal: {} of the last probes that were acknowledged to the PLC could not be "
                   "written and are lost",
                   probes)});
}

void MonitoringWorker::Reconfigure(Task task) {
  if (diagnosis_ && task.models.applied != models_.applied) {
    sink_({log::Event::kDiagnosisOutOfDate, "diagnosis stopped: another model is in force"});
    diagnosis_.reset();
  }
  if (task.models.applied != models_.applied) alarm_handled_ = false;
  config_ = std::move(task.config);
  if (!cameras_) cameras_ = config_.vision.cameras;
  models_ = task.models;
  CloseJournal();
  if (config_.monitoring.enabled) return OpenJournal();
  // Without a journal, its status must not be reported any more.
  quarantined_ = 0;
  quarantining_ = decision_unlogged_ = false;
  decisions_fault_.clear();
  fault_.clear();
}

/// Once the directory is writable again, reopens the journal at once and has models stored again.
void MonitoringWorker::PollStorage() {
  if (storage_ == nullptr || Clock::now() - storage_polled_ <= kStorageRetry) return;
  storage_polled_ = Clock::now();
  const bool recovered = storage_->Poll();
  heartbeat_.Beat();
  if (!recovered) return;
  journal_tried_ = {};
  if (models_.declared == 0) reload_();
}

/// After a failed write: checks whether the directory is the cause. Only a trial write finds what
/// the file system does not report: a quota, another owner, a failing disk. PollStorage() notices
/// the recovery.
void MonitoringWorker::CheckStorage() {
  if (storage_ == nullptr || !storage_->writable()) return;
  if (Clock::now() - storage_checked_ <= kStorageRetry) return;
  storage_checked_ = Clock::now();
  storage_->Check();
  heartbeat_.Beat();
}

void MonitoringWorker::OpenJournal() {
  journal_tried_ = Clock::now();
  if (storage_ != nullptr && !storage_->writable()) return;
  const Result<void> read = ReadJournal();
  if (read) return ReportRecovery();
  CloseJournal();  // a monitor that has seen only some of the rows is invalid
  ReportFault(read.error());
}

void MonitoringWorker::CloseJournal() {
  journal_.reset();
  monitor_.reset();
  alarm_unlogged_ = false;
}

/// Opens the journal and passes its rows to a new monitor. After an error both may be incomplete.
Result<void> MonitoringWorker::ReadJournal() {
  const std::string path = config_.state_directory + "/journal.sqlite";
  std::error_code absent;
  if (std::filesystem::file_size(path, absent) == 0 && !absent) {
    sink_(
        {log::Event::kJournalFault,
         fmt::format("journal: {} is empty: a new journal is started. Any probes recorded before, "
                     "including quarantined ones, are lost; restore the file if you have a copy",
                     path)});
  }
  Result<journal::Journal> opened = journal::Journal::Open(path, config_.monitoring.journal_bytes);
  if (!opened) return opened.failure();
  journal::Journal journal = std::move(opened).value();
  monitor_.emplace(config_.monitoring, sink_, [this] { heartbeat_.Beat(); });
  const auto restart = journal.LastRestart();
  const auto last_row = journal.LastRow();
  const auto last_probe_s = journal.LastProbeTime_s();
  if (!restart) return restart.failure();
  if (!last_row) return last_row.failure();
  if (!last_probe_s) return last_probe_s.failure();
  // Read before the rows: a decision made meanwhile is followed at the next poll.
  const auto decision = journal.LastDecision();
  const auto waiting = journal.Waiting();
  if (!decision) return decision.failure();
  if (!waiting) return waiting.failure();
  const auto since = *restart;
  if (!since || since->model_version != models_.applied) {
    const Result<void> recorded = journal.RecordMonitorRestart(models_.applied, "model");
    if (!recorded) return recorded.failure();
  }
  journal::JournalFilter filter;
  filter.after_id = since && since->model_version == models_.applied ? since->after_row : *last_row;
  filter.model_version = models_.applied;
  const Result<void> replayed = journal.ForEach(filter, config_.machine.cell.robot.joints,
                                                [this](const journal::JournalRow& row) {
                                                  heartbeat_.Beat();
                                                  UpdateMonitor(row, true);
                                                });
  if (!replayed) return replayed.failure();
  if (last_probe_s->has_value()) {
    const double behind_s = journal.EpochUtc_s() + **last_probe_s - service::SystemUtcSeconds();
    if (behind_s > 1) {
      sink_({log::Event::kClockBehind,
             fmt::format("the system clock is {:.0f} s behind the journal's last probe: one of the "
                         "two is wrong, and so are time-dependent effects. Set the clock",
                         behind_s)});
    }
  }
  journal_.emplace(std::move(journal));
  last_decision_ = *decision;
  quarantined_ = *waiting;
  if (monitor_->drift().reference_refused()) sink_(monitor_->ReferenceEntry());
  if (monitor_->drift().alarm() && alarm_unlogged_) {
    const Result<void> marked = journal_->Mark(monitor_->alarm_row(), false, true);
    if (!marked) return marked.failure();
    alarm_unlogged_ = false;
    alarm_handled_ = models_.proposed != 0;
    LogAlarm();
  } else if (monitor_->drift().alarm()) {
    sink_({log::Event::kDriftAlarmActive,
           fmt::format("drift alarm of journal row {} is still active", monitor_->alarm_row())});
    alarm_handled_ = alarm_handled_ || models_.proposed != 0;
  } else {
    alarm_handled_ = false;
  }
  if (decision_unlogged_) {
    sink_({log::Event::kQuarantineDecided,
           fmt::format("quarantine: probes were accepted or rejected, {} wait for a decision; the "
                       "drift monitor has reread the journal",
                       quarantined_)});
    decision_unlogged_ = false;
  }
  return {};
}

/// Stops writing to a journal file that was moved away; a new one is created in its place.
void MonitoringWorker::CloseMovedJournal() {
  if (!journal_) return;
  const Result<void> in_place = journal_->CheckNotMoved();
  if (in_place) return;
  ReportFault(in_place.error());
  CloseJournal();
  journal_tried_ = Clock::now();
}

bool MonitoringWorker::Handle(const CycleEvent& event) {
  CloseMovedJournal();
  if (!journal_) return !config_.monitoring.enabled;
  return event.monitor_restart ? RestartMonitor("person") : Record(event);
}

bool MonitoringWorker::RestartMonitor(const char* reason) {
  const Result<void> recorded = journal_->RecordMonitorRestart(models_.applied, reason);
  if (!recorded) {
    ReportFault(recorded.error());
    return false;
  }
  monitor_->Restart();
  alarm_handled_ = false;
  sink_({log::Event::kMonitorRestarted, "drift monitor restarted by the PLC"});
  return true;
}

bool MonitoringWorker::Record(const CycleEvent& event) {
  journal::JournalRow row =
      JournalRowFromProbe(event, config_.monitoring.session, journal_->EpochUtc_s(),
                          config_.machine.cell.artefacts, *cameras_);
  const std::vector<model::Joint>& joints = config_.machine.cell.robot.joints;
  if (row.q.size() != static_cast<Eigen::Index>(joints.size()))
    return true;  // from a previous cell
  const Result<std::int64_t> id = journal_->Append({row}, joints);
  if (!id) {
    ReportFault(id.error());
    return false;
  }
  heartbeat_.Beat();
  ReportRecovery();
  row.id = *id;
  ++recorded_;
  if (row.quarantine != journal::JournalRow::Quarantine::kNone) {
    LogQuarantined(row);
    return true;
  }
  quarantining_ = false;
  if (!row.measured_W) return true;  // on an artefact: for the diagnosis alone
  last_residual_m_ = *row.measured_W - *row.predicted_W;
  if (event.model_version == models_.applied) UpdateMonitor(row, false);
  return true;
}

/// Passes a row to the drift monitor, and records and logs what it found unless the row is
/// replayed.
void MonitoringWorker::UpdateMonitor(const journal::JournalRow& row, bool replayed) {
  const std::optional<RowVerdict> verdict = monitor_->Update(row, replayed);
  if (!verdict) return;
  if (verdict->raised) alarm_unlogged_ = replayed && !row.alarm;
  if (replayed) return;
  if (verdict->outlier || verdict->raised) {
    const Result<void> marked = journal_->Mark(row.id, verdict->outlier, verdict->raised);
    if (!marked) ReportFault(marked.error());
  }
  if (verdict->reference_complete) sink_(monitor_->ReferenceEntry());
  if (verdict->raised) LogAlarm();
}

void MonitoringWorker::LogAlarm() {
  sink_(monitor_->AlarmEntry(*journal_, config_.machine.cell.robot.joints, models_.applied));
}

void MonitoringWorker::LogQuarantined(const journal::JournalRow& row) {
  ++quarantined_;
  if (quarantining_) return;
  quarantining_ = true;
  const Vec3 off_mm = 1e3 * (*row.measured_W - *row.predicted_W);
  sink_({log::Event::kProbeQuarantined,
         fmt::format("probe quarantined: row {0} of the journal is ({1:.1f}, {2:.1f}, {3:.1f}) mm "
                     "from the tip predicted by the model, more than any plausible effect. It is "
                     "recorded, but excluded from drift monitoring and diagnosis. Check unit, "
                     "measurement frame and tool, then `plumbline journal quarantine accept {0}`, "
                     "or `reject {0}`",
                     row.id, off_mm.x(), off_mm.y(), off_mm.z()),
         {{"ROW", fmt::format("{}", row.id)}}});
}

/// Accepted rows take their place in time order, so the monitor rereads the journal. A running
/// diagnosis is restarted, because its input has changed.
void MonitoringWorker::FollowDecisions() {
  if (!journal_ || Clock::now() - decisions_read_ < kDecisionsRefresh) return;
  decisions_read_ = Clock::now();
  const Result<std::int64_t> decision = journal_->LastDecision();
  heartbeat_.Beat();
  if (!decision) {
    decisions_fault_ = decision.error();
    return ReportFault(decisions_fault_);
  }
  if (!decisions_fault_.empty() && fault_ == decisions_fault_) ReportRecovery();
  decisions_fault_.clear();
  if (*decision == last_decision_) return;
  if (diagnosis_) {
    sink_({log::Event::kDiagnosisOutOfDate,
           "diagnosis stopped: probes were accepted or rejected since it started. It starts again "
           "if the drift alarm remains"});
    diagnosis_.reset();
    alarm_handled_ = false;
    heartbeat_.Beat();
  }
  decision_unlogged_ = true;
  CloseJournal();
  OpenJournal();
}

void MonitoringWorker::StartDiagnosisIfDue() {
  if (!journal_ || !monitor_ || !monitor_->drift().alarm()) return;
  if (alarm_handled_ || diagnosis_ || !config_.monitoring.diagnose) return;
  const monitor::DriftMonitor& drift = monitor_->drift();
  const std::uint64_t since = drift.probes() - drift.alarm()->first_probe + 1;
  if (since < static_cast<std::uint64_t>(config_.monitoring.probes_before_diagnosis)) return;
  alarm_handled_ = true;
  Result<DiagnosisRun> started =
      DiagnosisRun::Start(config_, models_.applied, *journal_, monitor_->alarm_row(), sink_,
                          [this] { heartbeat_.Beat(); });
  diagnosis_failed_ = !started;
  if (started) {
    diagnosis_.emplace(std::move(started).value());
  } else {
    sink_({log::Event::kDiagnosisFailed, "diagnosis not started: " + started.error()});
  }
}

void MonitoringWorker::PollDiagnosis() {
  if (!diagnosis_) return;
  const std::optional<DiagnosisRun::Outcome> outcome =
      diagnosis_->Poll(config_, [this] { heartbeat_.Beat(); });
  if (!outcome) return;
  diagnosis_.reset();
  diagnosis_failed_ = !outcome->failure.empty();
  if (outcome->proposed != 0) models_.proposed = outcome->proposed;
  sink_({diagnosis_failed_ ? log::Event::kDiagnosisFailed : log::Event::kDiagnosisEnded,
         outcome->message});
  if (outcome->applied) reload_();
}

/// Follows proposals that a person adds or withdraws.
void MonitoringWorker::RefreshModels() {
  if (models_.applied == 0 || Clock::now() - models_read_ < kModelsRefresh) return;
  models_read_ = Clock::now();
  const Result<model_store::ModelStore> store =
      model_store::ModelStore::Open(config_.state_directory);
  if (!store) return;
  const Result<model_store::ModelState> state = store->State();
  if (state) models_.proposed = state->proposed;
}

void MonitoringWorker::PublishStatus() {
  status::MonitoringStatus status;
  const bool writable = storage_ == nullptr || storage_->writable();
  status.storage_unavailable = !writable;
  status.recording = journal_ && !event_pending_ && writable;
  status.drift_alarm = monitor_ && monitor_->drift().alarm();
  status.learning = monitor_ && monitor_->drift().learning();
  status.reference_refused = monitor_ && monitor_->drift().reference_refused();
  status.diagnosing = diagnosis_.has_value();
  status.fault = !fault_.empty() || diagnosis_failed_ || (config_.monitoring.enabled && !writable);
  status.settled = true;
  status.quarantined = static_cast<std::uint32_t>(quarantined_);
  status.probes = recorded_;
  status.drift_statistic = monitor_ ? monitor_->drift().statistic() : 0;
  status.residual_m = last_residual_m_;
  status.model.applied = models_.applied;
  status.model.proposed = models_.proposed;
  status.model.declared = models_.declared;
  mailboxes_.monitoring.Begin() = status;
  mailboxes_.monitoring.Publish();
}

void MonitoringWorker::ReportFault(const std::string& what) {
  if (fault_ != what) sink_({log::Event::kJournalFault, "journal: " + what});
  fault_ = what;
  CheckStorage();
}

void MonitoringWorker::ReportRecovery() {
  if (!fault_.empty()) sink_({log::Event::kJournalWorks, "journal works again"});
  fault_.clear();
}

}  // namespace plumbline::daemon
