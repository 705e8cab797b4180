#include "app/cell/daemon/monitoring_worker.h"

#include <fmt/format.h>
#include <pthread.h>

namespace plumbline::cell {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 200ms;  ///< if the cycle sends no event
constexpr auto kStorageRetry = 2s;
constexpr auto kModelsRefresh = 1s;

}  // namespace

MonitoringWorker::MonitoringWorker(CycleMailboxes& mailboxes, log::LogSink sink,
                                   std::function<void()> reload, StateStorage* storage)
    : mailboxes_(mailboxes),
      sink_(std::move(sink)),
      reload_(std::move(reload)),
      storage_(storage),
      journal_(
          config_, models_, sink_, [this] { heartbeat_.Beat(); }, storage) {}

MonitoringWorker::~MonitoringWorker() {
  Stop();
}

void MonitoringWorker::Configure(const config::DaemonConfig& config, const ModelState& models) {
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
    journal_.OpenIfDue();
    event_pending_ = false;
    while (const CycleEvent* event = mailboxes_.queue.Front()) {
      // An event that is not written remains queued; further probes are refused meanwhile.
      const std::uint32_t before = journal_.recorded();
      event_pending_ = !journal_.Handle(*event);
      if (event_pending_) break;
      if (event->gauge_press != 0) {
        if (journal_.recorded() == before) mailboxes_.gauges.dropped = event->gauge_press;
        mailboxes_.gauges.taken = event->gauge_press;
      }
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
    journal_.CloseIfMoved();
    PublishStatus();
  }
  journal_.CloseIfMoved();
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
  if (task.models.applied != models_.applied) journal_.SetFindingHandled(false);
  config_ = std::move(task.config);
  models_ = task.models;
  journal_.Reconfigure();
}

/// Once the directory is writable again, reopens the journal at once and has models stored again.
void MonitoringWorker::PollStorage() {
  if (storage_ == nullptr || Clock::now() - storage_polled_ <= kStorageRetry) return;
  storage_polled_ = Clock::now();
  const bool recovered = storage_->Poll();
  heartbeat_.Beat();
  if (!recovered) return;
  journal_.RetryAtOnce();
  if (models_.declared == 0) reload_();
}

/// A running diagnosis is restarted, because its input has changed.
void MonitoringWorker::FollowDecisions() {
  if (!journal_.WasDecided()) return;
  if (diagnosis_) {
    sink_({log::Event::kDiagnosisOutOfDate,
           "diagnosis stopped: probes were accepted or rejected since it started. It starts again "
           "if the drift alarm remains"});
    diagnosis_.reset();
    journal_.SetFindingHandled(false);
    heartbeat_.Beat();
  }
  journal_.Reread();
}

void MonitoringWorker::StartDiagnosisIfDue() {
  if (diagnosis_ || !config_.monitoring.diagnose) return;
  const std::uint64_t since = journal_.ProbesForDiagnosis();
  if (since == 0 || since < static_cast<std::uint64_t>(config_.monitoring.probes_before_diagnosis))
    return;
  journal_.SetFindingHandled(true);
  Result<DiagnosisRun> started =
      DiagnosisRun::Start(config_, models_.applied, *journal_.journal(), journal_.DiagnosisCause(),
                          sink_, [this] { heartbeat_.Beat(); });
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
  const Result<ModelStore> store = ModelStore::Open(config_.state_directory);
  if (!store) return;
  const Result<ModelState> state = store->State();
  if (state) models_.proposed = state->proposed;
}

void MonitoringWorker::PublishStatus() {
  status::MonitoringStatus status;
  journal_.Report(status);
  const bool writable = storage_ == nullptr || storage_->writable();
  status.storage_unavailable = !writable;
  status.recording = status.recording && !event_pending_ && writable;
  status.diagnosing = diagnosis_.has_value();
  status.fault = status.fault || diagnosis_failed_ || (config_.monitoring.enabled && !writable);
  status.settled = true;
  status.model.applied = models_.applied;
  status.model.proposed = models_.proposed;
  status.model.declared = models_.declared;
  mailboxes_.monitoring.Begin() = status;
  mailboxes_.monitoring.Publish();
}

}  // namespace plumbline::cell
