#include "app/daemon/loop_worker.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <filesystem>

#include "app/daemon/probe_row.h"
#include "app/service/utc_clock.h"
#include "firmware-like/monitor/run_length.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 200ms;  ///< where the cycle hands nothing over
constexpr auto kJournalRetry = 5s;
constexpr auto kStorageRetry = 2s;
constexpr auto kModelsRefresh = 1s;
constexpr auto kDecisionsRefresh = 1s;
constexpr std::size_t kMostRowsNamed = 12;

std::string CameraText(const std::string& name) {
  return name.empty() ? "a camera without name" : "camera " + name;
}

/// "rows 4, 7, 9", the first of them where there are many.
std::string RowsText(const std::vector<std::int64_t>& ids) {
  const std::size_t named = std::min(ids.size(), kMostRowsNamed);
  std::string text =
      fmt::format("row{} {}", ids.size() == 1 ? "" : "s",
                  fmt::join(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(named), ", "));
  if (named < ids.size()) text += fmt::format(" and {} more", ids.size() - named);
  return text;
}

/// @param step  called between its steps, which take a second together
MonitorDesign DesignFrom(const LoopConfig& loop, const std::function<void()>& step) {
  MonitorWish wish;
  wish.sigma_m = loop.probe_sigma_m;
  wish.shift_m = loop.shift_m;
  wish.probes_per_day = loop.probes_per_day;
  wish.false_alarms_per_year = loop.false_alarms_per_year;
  wish.reference_probes = loop.reference_probes;
  wish.reference_sd_m = loop.reference_sd_m;
  return MonitorDesignFor(wish, step);
}

}  // namespace

LoopWorker::LoopWorker(LoopLink& link, LogSink sink, std::function<void()> reload,
                       StateStorage* storage)
    : link_(link), sink_(std::move(sink)), reload_(std::move(reload)), storage_(storage) {}

LoopWorker::~LoopWorker() {
  Stop();
}

void LoopWorker::Configure(const DaemonConfig& config, const ModelState& models) {
  {
    const std::lock_guard lock(mutex_);
    next_ = Task{config, models};
  }
  link_.queue.Wake();
}

void LoopWorker::Start() {
  thread_ = std::thread([this] { Run(); });
  pthread_setname_np(thread_.native_handle(), "loop");
}

void LoopWorker::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  link_.queue.Wake();
  if (thread_.joinable()) thread_.join();
}

void LoopWorker::Run() {
  for (;;) {
    pulse_.Beat();
    link_.queue.Wait(kPeriod);
    std::optional<Task> task;
    bool stop = false;
    {
      const std::lock_guard lock(mutex_);
      std::swap(task, next_);
      stop = stop_;
    }
    if (task) TakeOver(std::move(*task));
    WatchStorage();
    if (config_.loop.enabled && !journal_ && Clock::now() - journal_tried_ > kJournalRetry) {
      OpenJournal();
    }
    waits_ = false;
    while (const LoopEvent* event = link_.queue.Front()) {
      waits_ = !Take(*event);  // it stays, and the PLC is refused meanwhile
      if (waits_) break;
      link_.queue.Pop();
      pulse_.Beat();
    }
    if (stop) break;
    // Each may wait for another program's lock on journal or models.
    pulse_.Beat();
    ConsiderDiagnosis();
    pulse_.Beat();
    WatchDiagnosis();
    pulse_.Beat();
    RefreshModels();
    pulse_.Beat();
    FollowDecisions();
    pulse_.Beat();
    LeaveMovedJournal();
    Tell();
  }
  LeaveMovedJournal();
  TellLost();
  diagnosis_.reset();
}

/// What was taken of the PLC and could not be written until the end.
void LoopWorker::TellLost() {
  int probes = 0;
  for (; const LoopEvent* event = link_.queue.Front(); link_.queue.Pop()) {
    probes += event->monitor_restart ? 0 : 1;
  }
  if (probes == 0) return;
  sink_({Event::kJournalFault,
         fmt::format("journal: {} of the last probes that the PLC was told as taken could not be "
                     "written, and are lost",
                     probes)});
}

void LoopWorker::TakeOver(Task task) {
  if (diagnosis_ && task.models.applied != models_.applied) {
    sink_({Event::kDiagnosisOutOfDate, "diagnosis ended: another model is in force"});
    diagnosis_.reset();
  }
  if (task.models.applied != models_.applied) alarm_handled_ = false;
  config_ = std::move(task.config);
  if (!cameras_) cameras_ = config_.vision.cameras;
  models_ = task.models;
  CloseJournal();
  if (config_.loop.enabled) return OpenJournal();
  // Without a journal nothing of it is reported any more.
  waiting_ = 0;
  quarantining_ = decided_ = false;
  decisions_fault_.clear();
  fault_.clear();
}

/// The journal is opened at once where the directory works again, and models are kept again.
void LoopWorker::WatchStorage() {
  if (storage_ == nullptr || Clock::now() - storage_watched_ <= kStorageRetry) return;
  storage_watched_ = Clock::now();
  const bool back = storage_->Watch();
  pulse_.Beat();
  if (!back) return;
  journal_tried_ = {};
  if (models_.declared == 0) reload_();
}

/// After something could not be written: is it the directory? Only this finds what the file system
/// does not report of itself: a quota, another owner, a failing disk. That it works again is
/// WatchStorage()'s.
void LoopWorker::CheckStorage() {
  if (storage_ == nullptr || !storage_->works()) return;
  if (Clock::now() - storage_checked_ <= kStorageRetry) return;
  storage_checked_ = Clock::now();
  storage_->Check();
  pulse_.Beat();
}

void LoopWorker::OpenJournal() {
  journal_tried_ = Clock::now();
  if (storage_ != nullptr && !storage_->works()) return;
  const Result<void> read = ReadJournal();
  if (read) return Recovered();
  CloseJournal();  // a monitor that has seen some of the rows must not judge, nor be reported
  Fail(read.error());
}

void LoopWorker::CloseJournal() {
  journal_.reset();
  monitor_.reset();
  alarm_new_ = false;
}

/// Opens the journal and shows its rows to a new monitor. After an error both may be half set up.
Result<void> LoopWorker::ReadJournal() {
  const std::string path = config_.state_directory + "/journal.sqlite";
  std::error_code absent;
  if (std::filesystem::file_size(path, absent) == 0 && !absent) {
    sink_(
        {Event::kJournalFault,
         fmt::format("journal: {} is empty: a new journal is started. Any probes recorded before, "
                     "quarantined ones included, are lost; restore the file if you have a copy",
                     path)});
  }
  Result<Journal> opened = Journal::Open(path, config_.loop.journal_bytes);
  if (!opened) return opened.failure();
  Journal journal = std::move(opened).value();
  monitor_.emplace(DesignFrom(config_.loop, [this] { pulse_.Beat(); }));
  NewReference();
  const auto restart = journal.LastRestart();
  const auto last_row = journal.LastRow();
  const auto last_probe_s = journal.LastProbe_s();
  if (!restart) return restart.failure();
  if (!last_row) return last_row.failure();
  if (!last_probe_s) return last_probe_s.failure();
  // Before the rows are read: a decision made meanwhile is followed at the next look.
  const auto decision = journal.LastDecision();
  const auto waiting = journal.Waiting();
  if (!decision) return decision.failure();
  if (!waiting) return waiting.failure();
  const auto since = *restart;
  if (!since || since->model_version != models_.applied) {
    const Result<void> noted = journal.NoteRestart(models_.applied, "model");
    if (!noted) return noted.failure();
  }
  JournalFilter filter;
  filter.after_id = since && since->model_version == models_.applied ? since->after_row : *last_row;
  filter.model_version = models_.applied;
  const Result<void> replayed =
      journal.ForEach(filter, config_.machine.cell.robot.joints, [this](const JournalRow& row) {
        pulse_.Beat();
        Judge(row, true);
      });
  if (!replayed) return replayed.failure();
  if (last_probe_s->has_value()) {
    const double behind_s = journal.EpochUtc_s() + **last_probe_s - ComputerUtcSeconds();
    if (behind_s > 1) {
      sink_({Event::kClockBehind,
             fmt::format("the computer's clock is {:.0f} s behind the journal's last probe: one of "
                         "the two is wrong, and so are effects of time",
                         behind_s)});
    }
  }
  journal_.emplace(std::move(journal));
  decision_ = *decision;
  waiting_ = *waiting;
  if (monitor_->reference_refused()) TellReference();
  if (monitor_->alarm() && alarm_new_) {
    const Result<void> marked = journal_->Mark(alarm_row_, false, true);
    if (!marked) return marked.failure();
    alarm_new_ = false;
    alarm_handled_ = models_.proposed != 0;
    TellAlarm();
  } else if (monitor_->alarm()) {
    sink_({Event::kDriftStands,
           fmt::format("drift alarm of row {} of the journal still stands", alarm_row_)});
    alarm_handled_ = alarm_handled_ || models_.proposed != 0;
  } else {
    alarm_handled_ = false;
  }
  if (decided_) {
    sink_({Event::kQuarantineDecided,
           fmt::format("quarantine: probes were accepted or rejected, {} wait for a decision; the "
                       "drift monitor has read the journal again",
                       waiting_)});
    decided_ = false;
  }
  return {};
}

/// A journal that was moved away takes no more probes; a new one is begun in its place.
void LoopWorker::LeaveMovedJournal() {
  if (!journal_) return;
  const auto moved = journal_->Moved();
  if (!moved) return;
  Fail(moved->message);
  CloseJournal();
  journal_tried_ = Clock::now();
}

bool LoopWorker::Take(const LoopEvent& event) {
  LeaveMovedJournal();
  if (!journal_) return !config_.loop.enabled;
  return event.monitor_restart ? RestartMonitor("person") : Record(event);
}

bool LoopWorker::RestartMonitor(const char* reason) {
  const Result<void> noted = journal_->NoteRestart(models_.applied, reason);
  if (!noted) {
    Fail(noted.error());
    return false;
  }
  monitor_->Restart();
  NewReference();
  alarm_handled_ = false;
  sink_({Event::kMonitorRestarted, "drift monitor restarted by the PLC"});
  return true;
}

bool LoopWorker::Record(const LoopEvent& event) {
  JournalRow row = RowOfProbe(event, config_.loop.session, journal_->EpochUtc_s(), *cameras_);
  const std::vector<Joint>& joints = config_.machine.cell.robot.joints;
  if (row.q.size() != static_cast<Eigen::Index>(joints.size())) return true;  // of a former cell
  const Result<std::int64_t> id = journal_->Append({row}, joints);
  if (!id) {
    Fail(id.error());
    return false;
  }
  pulse_.Beat();
  Recovered();
  row.id = *id;
  ++recorded_;
  if (row.quarantine != JournalRow::Quarantine::kNone) {
    TellQuarantined(row);
    return true;
  }
  quarantining_ = false;
  last_residual_m_ = *row.measured_W - *row.predicted_W;
  if (event.model_version == models_.applied) Judge(row, false);
  return true;
}

void LoopWorker::NewReference() {
  reference_camera_.reset();
  passed_over_.clear();
  judged_.clear();
}

bool LoopWorker::IsOfReference(const JournalRow& row, bool replayed) {
  if (row.source != JournalRow::Source::kCamera) return true;
  if (!reference_camera_) reference_camera_ = row.camera;
  if (row.camera == *reference_camera_) return true;
  if (!replayed && passed_over_.insert(row.camera).second) {
    sink_({Event::kProbesUnwatched,
           fmt::format("probes by {} are kept, and not watched for drift: the reference is of {}",
                       CameraText(row.camera), CameraText(*reference_camera_))});
  }
  return false;
}

void LoopWorker::Judge(const JournalRow& row, bool replayed) {
  if (!MayBeJudged(row, config_.loop.probe_sigma_m) || !IsOfReference(row, replayed)) return;
  const bool was_learning = monitor_->learning();
  const ProbeVerdict verdict = monitor_->Update(*row.measured_W - *row.predicted_W);
  if (verdict.unmonitored) return;
  judged_.push_back(row.id);
  if (verdict.raised) {
    alarm_row_ = row.id;
    alarm_new_ = replayed && !row.alarm;
  }
  if (replayed) return;
  if (verdict.outlier || verdict.raised) {
    const Result<void> marked = journal_->Mark(row.id, verdict.outlier, verdict.raised);
    if (!marked) Fail(marked.error());
  }
  if (was_learning && !monitor_->learning()) TellReference();
  if (verdict.raised) TellAlarm();
}

/// That there is a reference, or why there is none.
void LoopWorker::TellReference() {
  if (!monitor_->reference_refused()) {
    const Vec3 reference_mm = 1e3 * monitor_->reference_m();
    sink_({Event::kMonitorLearnt,
           fmt::format("drift monitor has its reference: residual ({:.3f}, {:.3f}, {:.3f}) mm, "
                       "scatter {:.3f} mm",
                       reference_mm.x(), reference_mm.y(), reference_mm.z(),
                       1e3 * monitor_->sigma_m())});
    return;
  }
  std::vector<std::int64_t> disagree;
  for (std::size_t k = 0; k < judged_.size(); ++k) {
    if (monitor_->Disagrees(static_cast<int>(k))) disagree.push_back(judged_[k]);
  }
  const double sigma_mm = 1e3 * monitor_->design().sigma_m;
  const ReferenceFault fault = monitor_->reference_fault();
  const std::string why =
      fault == ReferenceFault::kOutliers
          ? fmt::format(
                "{} of them lie farther from the others than their scatter explains "
                "(99.99 %): {}",
                disagree.size(), RowsText(disagree))
      : fault == ReferenceFault::kScatter
          ? fmt::format("they scatter by {:.3f} mm, over {:.0f} times probe_sigma_mm ({:.3f}): {}",
                        1e3 * monitor_->sigma_m(), DriftMonitor::kMostScatter, sigma_mm,
                        RowsText(disagree))
          : fmt::format(
                "they scatter by {:.3f} mm, more than probe_sigma_mm ({:.3f}), and each "
                "resembles the one before it: something moved while they were taken",
                1e3 * monitor_->sigma_m(), sigma_mm);
  sink_({Event::kReferenceRefused,
         fmt::format("drift monitor's reference refused: its {} probes, rows {} to {}, disagree; "
                     "{}. Nothing is watched for drift. Inspect them (`plumbline journal show`), "
                     "then take a new reference by command 8; where poses differ by so much, raise "
                     "probe_sigma_mm",
                     judged_.size(), judged_.front(), judged_.back(), why)});
}

void LoopWorker::TellQuarantined(const JournalRow& row) {
  ++waiting_;
  if (quarantining_) return;
  quarantining_ = true;
  const Vec3 off_mm = 1e3 * (*row.measured_W - *row.predicted_W);
  sink_(
      {Event::kProbeQuarantined,
       fmt::format("probe quarantined: row {0} of the journal is ({1:.1f}, {2:.1f}, {3:.1f}) mm "
                   "from where the model has the tip, more than any plausible effect. It is kept, "
                   "but neither watched for drift nor diagnosed. Check unit, measurement frame "
                   "and tool, then `plumbline journal quarantine accept {0}`, or `reject {0}`",
                   row.id, off_mm.x(), off_mm.y(), off_mm.z()),
       {{"ROW", fmt::format("{}", row.id)}}});
}

/// What a person accepts takes its place among the rows in order of time: the monitor reads them
/// again. So does a diagnosis, whose rows are others now.
void LoopWorker::FollowDecisions() {
  if (!journal_ || Clock::now() - decisions_read_ < kDecisionsRefresh) return;
  decisions_read_ = Clock::now();
  const Result<std::int64_t> decision = journal_->LastDecision();
  pulse_.Beat();
  if (!decision) {
    decisions_fault_ = decision.error();
    return Fail(decisions_fault_);
  }
  if (!decisions_fault_.empty() && fault_ == decisions_fault_) Recovered();
  decisions_fault_.clear();
  if (*decision == decision_) return;
  if (diagnosis_) {
    sink_({Event::kDiagnosisOutOfDate,
           "diagnosis ended: probes were accepted or rejected since it started. It starts again "
           "where the drift alarm remains"});
    diagnosis_.reset();
    alarm_handled_ = false;
    pulse_.Beat();
  }
  decided_ = true;
  CloseJournal();
  OpenJournal();
}

void LoopWorker::TellAlarm() {
  const DriftAlarm& alarm = *monitor_->alarm();
  const Vec3 shift_mm = 1e3 * ShiftOver(alarm);
  sink_({Event::kDriftAlarm,
         fmt::format("drift alarm: the residual of probes changed by ({:.3f}, {:.3f}, {:.3f}) mm "
                     "within the last {} probes; row {} of the journal",
                     shift_mm.x(), shift_mm.y(), shift_mm.z(), alarm.probe - alarm.first_probe + 1,
                     alarm_row_)});
}

/// The change for a person to read: the median over the probes that took part. The monitor's own
/// estimate shortens each of them, and tells a change of millimetres too small.
Vec3 LoopWorker::ShiftOver(const DriftAlarm& alarm) {
  const auto count = static_cast<std::size_t>(alarm.probe - alarm.first_probe + 1);
  if (count > judged_.size()) return alarm.shift_m;
  const std::vector<std::int64_t> part(judged_.end() - static_cast<std::ptrdiff_t>(count),
                                       judged_.end());
  JournalFilter filter;
  filter.after_id = part.front() - 1;
  filter.model_version = models_.applied;
  const auto rows = journal_->Read(filter, config_.machine.cell.robot.joints);
  if (!rows || rows->empty()) return alarm.shift_m;
  Vec3 shift_m;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const JournalRow& row : *rows) {
      const bool judged = std::binary_search(part.begin(), part.end(), row.id);
      if (judged && row.measured_W && row.predicted_W) {
        values.push_back((*row.measured_W)[k] - (*row.predicted_W)[k]);
      }
    }
    if (values.empty()) return alarm.shift_m;
    shift_m[k] = MedianOf(values) - monitor_->reference_m()[k];
  }
  return shift_m;
}

void LoopWorker::ConsiderDiagnosis() {
  if (!journal_ || !monitor_ || !monitor_->alarm()) return;
  if (alarm_handled_ || diagnosis_ || !config_.loop.diagnose) return;
  const std::uint64_t since = monitor_->probes() - monitor_->alarm()->first_probe + 1;
  if (since < static_cast<std::uint64_t>(config_.loop.probes_before_diagnosis)) return;
  alarm_handled_ = true;
  Result<DiagnosisRun> started = DiagnosisRun::Start(config_, models_.applied, *journal_,
                                                     alarm_row_, sink_, [this] { pulse_.Beat(); });
  diagnosis_failed_ = !started;
  if (started) {
    diagnosis_.emplace(std::move(started).value());
  } else {
    sink_({Event::kDiagnosisFailed, "diagnosis not started: " + started.error()});
  }
}

void LoopWorker::WatchDiagnosis() {
  if (!diagnosis_) return;
  const std::optional<DiagnosisRun::Outcome> outcome =
      diagnosis_->Poll(config_, [this] { pulse_.Beat(); });
  if (!outcome) return;
  diagnosis_.reset();
  diagnosis_failed_ = !outcome->failure.empty();
  if (outcome->proposed != 0) models_.proposed = outcome->proposed;
  sink_({diagnosis_failed_ ? Event::kDiagnosisFailed : Event::kDiagnosisEnded, outcome->told});
  if (outcome->applied) reload_();
}

/// A proposal may come from a person, or be withdrawn by one.
void LoopWorker::RefreshModels() {
  if (models_.applied == 0 || Clock::now() - models_read_ < kModelsRefresh) return;
  models_read_ = Clock::now();
  const Result<ModelStore> store = ModelStore::Open(config_.state_directory);
  if (!store) return;
  const Result<ModelState> state = store->State();
  if (state) models_.proposed = state->proposed;
}

void LoopWorker::Tell() {
  MonitoringStatus status;
  const bool stores = storage_ == nullptr || storage_->works();
  status.storage_unavailable = !stores;
  status.recording = journal_ && !waits_ && stores;
  status.drift_alarm = monitor_ && monitor_->alarm();
  status.learning = monitor_ && monitor_->learning();
  status.reference_refused = monitor_ && monitor_->reference_refused();
  status.diagnosing = diagnosis_.has_value();
  status.fault = !fault_.empty() || diagnosis_failed_ || (config_.loop.enabled && !stores);
  status.settled = true;
  status.quarantined = static_cast<std::uint32_t>(waiting_);
  status.probes = recorded_;
  status.drift_statistic = monitor_ ? monitor_->statistic() : 0;
  status.residual_m = last_residual_m_;
  status.model.applied = models_.applied;
  status.model.proposed = models_.proposed;
  status.model.declared = models_.declared;
  link_.monitoring.Begin() = status;
  link_.monitoring.Publish();
}

void LoopWorker::Fail(const std::string& what) {
  if (fault_ != what) sink_({Event::kJournalFault, "journal: " + what});
  fault_ = what;
  CheckStorage();
}

void LoopWorker::Recovered() {
  if (!fault_.empty()) sink_({Event::kJournalWorks, "journal works again"});
  fault_.clear();
}

}  // namespace plumbline
