#include "app/cell/daemon/monitored_journal.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "app/base/service/utc_clock.h"
#include "app/cell/daemon/row_drift_monitor.h"

namespace plumbline::cell {
namespace {

using namespace std::chrono_literals;

constexpr auto kJournalRetry = 5s;
constexpr auto kStorageCheck = 2s;
constexpr auto kDecisionsRefresh = 1s;

}  // namespace

MonitoredJournal::MonitoredJournal(const config::DaemonConfig& config, const ModelState& models,
                                   log::LogSink sink, std::function<void()> step,
                                   StateStorage* storage)
    : config_(config),
      models_(models),
      sink_(std::move(sink)),
      step_(std::move(step)),
      storage_(storage) {}

void MonitoredJournal::Reconfigure() {
  if (!cameras_) cameras_ = config_.vision.cameras;
  Close();
  if (config_.monitoring.enabled) return Open();
  // Without a journal, its status must not be reported any more.
  quarantined_ = 0;
  quarantining_ = decision_unlogged_ = false;
  decisions_fault_.clear();
  fault_.clear();
  contradicted_ = false;
}

void MonitoredJournal::OpenIfDue() {
  if (config_.monitoring.enabled && !journal_ && Clock::now() - tried_ > kJournalRetry) Open();
}

void MonitoredJournal::Open(std::optional<Journal> open) {
  tried_ = Clock::now();
  if (storage_ != nullptr && !storage_->writable()) return;
  const Result<void> read = Read(std::move(open));
  if (read) return ReportRecovery();
  Close();  // a monitor that has seen only some of the rows is invalid
  ReportFault(read.error());
}

bool MonitoredJournal::RadiusContradicted() const {
  return journal_ && monitor_ ? monitor_->radius_contradicted() : contradicted_;
}

void MonitoredJournal::Close() {
  contradicted_ = RadiusContradicted();
  journal_.reset();
  monitor_.reset();
  alarm_unlogged_ = false;
}

/// Opens and checks the journal file.
Result<Journal> MonitoredJournal::OpenFile() {
  const std::string path = config_.state_directory + "/journal.sqlite";
  std::error_code absent;
  if (std::filesystem::file_size(path, absent) == 0 && !absent) {
    sink_(
        {log::Event::kJournalFault,
         fmt::format("journal: {} is empty: a new journal is started. Any probes recorded before, "
                     "including quarantined ones, are lost; restore the file if you have a copy",
                     path)});
  }
  return Journal::Open(path, config_.monitoring.journal_bytes, [this] { step_(); });
}

/// Passes the rows of the journal to a new monitor. After an error both may be incomplete.
/// @param open  the journal, if it is open already; else it is opened
Result<void> MonitoredJournal::Read(std::optional<Journal> open) {
  if (!open) {
    Result<Journal> opened = OpenFile();
    if (!opened) return opened.failure();
    open.emplace(std::move(opened).value());
  }
  Journal journal = std::move(*open);
  monitor_.emplace(config_.monitoring, sink_, [this] { step_(); });
  const Result<std::optional<double>> last_probe_s = journal.LastProbeTime_s();
  if (!last_probe_s) return last_probe_s.failure();
  // Read before the rows: a decision made meanwhile is followed at the next poll.
  const auto decision = journal.LastDecision();
  const auto waiting = journal.Waiting();
  if (!decision) return decision.failure();
  if (!waiting) return waiting.failure();
  if (const Result<void> replayed = ReadRows(journal); !replayed) return replayed.failure();
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
  return LogRead();
}

/// Replays the rows since the model in force was applied or the monitor restarted.
Result<void> MonitoredJournal::ReadRows(Journal& journal) {
  const auto restart = journal.LastRestart();
  const auto last_row = journal.LastRow();
  if (!restart) return restart.failure();
  if (!last_row) return last_row.failure();
  const auto since = *restart;
  const bool same_model = since && since->model_version == models_.applied;
  if (!same_model) {
    const Result<void> recorded = journal.RecordMonitorRestart(models_.applied, "model");
    if (!recorded) return recorded.failure();
  }
  monitor_->SetRadiusContradicted(same_model && since->radius_contradicted);
  JournalFilter filter;
  filter.after_id = same_model ? since->after_row : *last_row;
  filter.model_version = models_.applied;
  return journal.ForEach(filter, config_.machine.cell.robot.joints, [this](const JournalRow& row) {
    step_();
    UpdateMonitor(row, true);
  });
}

/// Logs the alarm and the decisions that the rows just read revealed.
Result<void> MonitoredJournal::LogRead() {
  if (monitor_->drift().reference_refused()) sink_(monitor_->ReferenceEntry());
  if (monitor_->drift().alarm() && alarm_unlogged_) {
    const Result<void> marked = journal_->Mark(monitor_->alarm_row(), false, true);
    if (!marked) return marked.failure();
    alarm_unlogged_ = false;
    finding_handled_ = models_.proposed != 0;
    LogAlarm();
  } else if (monitor_->drift().alarm()) {
    sink_({log::Event::kDriftAlarmActive,
           fmt::format("drift alarm of journal row {} is still active", monitor_->alarm_row())});
    finding_handled_ = finding_handled_ || models_.proposed != 0;
  } else {
    finding_handled_ =
        monitor_->radius_contradicted() && (finding_handled_ || models_.proposed != 0);
  }
  if (monitor_->contradicted_by_reference()) sink_(monitor_->ContradictionEntry());
  if (decision_unlogged_) {
    sink_({log::Event::kQuarantineDecided,
           fmt::format("quarantine: probes were accepted or rejected, {} wait for a decision; the "
                       "drift monitor has reread the journal",
                       quarantined_)});
    decision_unlogged_ = false;
  }
  return {};
}

void MonitoredJournal::CloseIfMoved() {
  if (!journal_) return;
  const Result<void> in_place = journal_->CheckNotMoved();
  if (in_place) return;
  ReportFault(in_place.error());
  Close();
  tried_ = Clock::now();
}

bool MonitoredJournal::Handle(const CycleEvent& event) {
  CloseIfMoved();
  if (!journal_) return !config_.monitoring.enabled;
  return event.monitor_restart ? RestartMonitor("person") : Record(event);
}

bool MonitoredJournal::RestartMonitor(const char* reason) {
  const Result<void> recorded =
      journal_->RecordMonitorRestart(models_.applied, reason, monitor_->radius_contradicted());
  if (!recorded) {
    ReportFault(recorded.error());
    return false;
  }
  monitor_->Restart();
  finding_handled_ = false;
  sink_({log::Event::kMonitorRestarted, "drift monitor restarted by the PLC"});
  return true;
}

bool MonitoredJournal::Record(const CycleEvent& event) {
  JournalRow row = JournalRowFromProbe(event, config_.monitoring.session, journal_->EpochUtc_s(),
                                       config_.machine.cell.artefacts, *cameras_);
  const std::vector<model::Joint>& joints = config_.machine.cell.robot.joints;
  if (row.q.size() != static_cast<Eigen::Index>(joints.size()))
    return true;  // from a previous cell
  const Result<std::int64_t> id = journal_->Append({row}, joints);
  if (!id) {
    ReportFault(id.error());
    return false;
  }
  step_();
  ReportRecovery();
  row.id = *id;
  ++recorded_;
  if (row.quarantine != JournalRow::Quarantine::kNone) {
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
void MonitoredJournal::UpdateMonitor(const JournalRow& row, bool replayed) {
  const std::optional<RowVerdict> verdict = monitor_->Update(row, replayed);
  if (!verdict) return;
  if (verdict->raised) alarm_unlogged_ = replayed && !row.alarm;
  if (replayed) return;
  if (verdict->outlier || verdict->raised) {
    const Result<void> marked = journal_->Mark(row.id, verdict->outlier, verdict->raised);
    if (!marked) ReportFault(marked.error());
  }
  if (verdict->reference_complete) {
    sink_(monitor_->ReferenceEntry());
    if (monitor_->contradicted_by_reference()) sink_(monitor_->ContradictionEntry());
  }
  if (verdict->raised) {
    finding_handled_ = false;  // a diagnosis of the reference has not seen these probes
    LogAlarm();
  }
}

void MonitoredJournal::LogAlarm() {
  sink_(monitor_->AlarmEntry(*journal_, config_.machine.cell.robot.joints, models_.applied));
}

void MonitoredJournal::LogQuarantined(const JournalRow& row) {
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

bool MonitoredJournal::WasDecided() {
  if (!journal_ || Clock::now() - decisions_read_ < kDecisionsRefresh) return false;
  decisions_read_ = Clock::now();
  const Result<std::int64_t> decision = journal_->LastDecision();
  step_();
  if (!decision) {
    decisions_fault_ = decision.error();
    ReportFault(decisions_fault_);
    return false;
  }
  if (!decisions_fault_.empty() && fault_ == decisions_fault_) ReportRecovery();
  decisions_fault_.clear();
  return *decision != last_decision_;
}

void MonitoredJournal::Reread() {
  decision_unlogged_ = true;
  // The file stays open: opening it would check all of it again, for every decision.
  contradicted_ = RadiusContradicted();
  std::optional<Journal> open = std::exchange(journal_, std::nullopt);
  Close();
  Open(std::move(open));
}

std::uint64_t MonitoredJournal::ProbesForDiagnosis() const {
  if (!journal_ || !monitor_ || finding_handled_) return 0;
  const monitor::DriftMonitor& drift = monitor_->drift();
  if (!drift.alarm()) return monitor_->contradicted_by_reference() ? drift.probes() : 0;
  return drift.probes() - drift.alarm()->first_probe + 1;
}

std::string MonitoredJournal::DiagnosisCause() const {
  return monitor_->drift().alarm()
             ? fmt::format("drift alarm of journal row {}", monitor_->alarm_row())
             : fmt::format("reference that contradicts the stated radius, {}",
                           monitor_->ReferenceRows());
}

void MonitoredJournal::Report(status::MonitoringStatus& status) const {
  status.recording = journal_.has_value();
  status.drift_alarm = monitor_ && monitor_->drift().alarm();
  status.learning = monitor_ && monitor_->drift().learning();
  if (monitor_) {
    const monitor::DriftMonitor& drift = monitor_->drift();
    status.reference_wanted = drift.design().reference_probes;
    status.reference_learned =
        drift.learning() ? static_cast<int>(drift.probes()) : status.reference_wanted;
  }
  status.reference_refused = monitor_ && monitor_->drift().reference_refused();
  status.radius_contradicted = RadiusContradicted();
  status.fault = !fault_.empty();
  status.quarantined = static_cast<std::uint32_t>(quarantined_);
  status.probes = recorded_;
  status.drift_statistic = monitor_ ? monitor_->drift().statistic() : 0;
  status.residual_m = last_residual_m_;
}

/// After a failed write: checks whether the directory is the cause. Only a trial write finds what
/// the file system does not report: a quota, another owner, a failing disk. StateStorage::Poll()
/// notices the recovery.
void MonitoredJournal::CheckStorage() {
  if (storage_ == nullptr || !storage_->writable()) return;
  if (Clock::now() - storage_checked_ <= kStorageCheck) return;
  storage_checked_ = Clock::now();
  storage_->Check();
  step_();
}

void MonitoredJournal::ReportFault(const std::string& what) {
  if (fault_ != what) sink_({log::Event::kJournalFault, "journal: " + what});
  fault_ = what;
  CheckStorage();
}

void MonitoredJournal::ReportRecovery() {
  if (!fault_.empty()) sink_({log::Event::kJournalWorks, "journal works again"});
  fault_.clear();
}

}  // namespace plumbline::cell
