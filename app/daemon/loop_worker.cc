#include "app/daemon/loop_worker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>

#include <algorithm>
#include <filesystem>

#include "app/config/cell_reader.h"
#include "app/config/text_file.h"
#include "app/config/utc_text.h"
#include "app/daemon/utc_clock.h"
#include "app/journal/journal_csv.h"
#include "app/model_store/durable_file.h"
#include "app/model_store/model_change.h"
#include "app/model_store/model_json.h"
#include "app/model_store/usable_model.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/monitor/run_length.h"

namespace plumbline {
namespace {

using namespace std::chrono_literals;

constexpr auto kPeriod = 20ms;
constexpr auto kJournalRetry = 5s;
constexpr auto kModelsRefresh = 1s;
constexpr std::int64_t kMostDiagnosedRows = 12000;  // the newest: about a minute's work

std::string Folder(const DaemonConfig& config) {
  return config.state_directory + "/diagnosis";
}

MonitorDesign DesignFrom(const LoopConfig& loop) {
  MonitorWish wish;
  wish.sigma_m = loop.probe_sigma_m;
  wish.shift_m = loop.shift_m;
  wish.probes_per_day = loop.probes_per_day;
  wish.false_alarms_per_year = loop.false_alarms_per_year;
  wish.reference_probes = loop.reference_probes;
  wish.reference_sd_m = loop.reference_sd_m;
  return MonitorDesignFor(wish);
}

JournalRow RowFrom(const LoopEvent& event, const std::string& session, double epoch_utc_s) {
  const Probe& probe = event.probe;
  JournalRow row;
  row.source = JournalRow::Source::kPlc;
  row.unix_ms = probe.unix_ms;
  row.t_s = probe.utc_s - epoch_utc_s;
  row.session = session;
  row.command = probe.sequence;
  row.q = probe.q;
  row.q_step_rad = probe.q_resolution;
  row.payload_kg = probe.payload_kg;
  row.temp_C = probe.temp_C;
  row.predicted_W = probe.predicted_W;
  row.measured_W = probe.measured_W;
  row.model_version = event.model_version;
  return row;
}

}  // namespace

LoopWorker::LoopWorker(LoopLink& link, Sink sink, std::function<void()> reload)
    : link_(link), sink_(std::move(sink)), reload_(std::move(reload)) {}

LoopWorker::~LoopWorker() {
  Stop();
}

void LoopWorker::Configure(const DaemonConfig& config, const ModelState& models) {
  const std::lock_guard lock(mutex_);
  next_ = Task{config, models};
  wake_.notify_one();
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
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void LoopWorker::Run() {
  for (;;) {
    std::optional<Task> task;
    bool stop = false;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kPeriod, [this] { return stop_ || next_.has_value(); });
      std::swap(task, next_);
      stop = stop_;
    }
    if (task) TakeOver(std::move(*task));
    if (config_.loop.enabled && !journal_ && Clock::now() - journal_tried_ > kJournalRetry) {
      OpenJournal();
    }
    while (const LoopEvent* event = link_.queue.Front()) {
      if (!Take(*event)) break;  // it stays; the PLC is refused while the queue is full
      link_.queue.Pop();
    }
    if (stop) break;
    ConsiderDiagnosis();
    WatchDiagnosis();
    RefreshModels();
    Tell();
  }
  diagnosis_.reset();
}

void LoopWorker::TakeOver(Task task) {
  if (diagnosis_ && task.models.applied != models_.applied) {
    sink_(LogLevel::kNotice, "diagnosis ended: another model is in force");
    diagnosis_.reset();
  }
  if (task.models.applied != models_.applied) alarm_handled_ = false;
  config_ = std::move(task.config);
  models_ = task.models;
  journal_.reset();
  monitor_.reset();
  if (config_.loop.enabled) OpenJournal();
}

void LoopWorker::OpenJournal() {
  journal_tried_ = Clock::now();
  Result<Journal> opened = Journal::Open(config_.state_directory + "/journal.sqlite");
  if (!opened) return Fail(opened.error());
  Journal journal = std::move(opened).value();
  monitor_.emplace(DesignFrom(config_.loop));
  const auto restart = journal.LastRestart();
  const auto last_row = journal.LastRow();
  const auto last_probe_s = journal.LastProbe_s();
  if (!restart) return Fail(restart.error());
  if (!last_row) return Fail(last_row.error());
  if (!last_probe_s) return Fail(last_probe_s.error());
  const auto since = *restart;
  if (!since || since->model_version != models_.applied) {
    const Result<bool> noted = journal.NoteRestart(models_.applied, "model");
    if (!noted) return Fail(noted.error());
  }
  JournalFilter filter;
  filter.after_id = since && since->model_version == models_.applied ? since->after_row : *last_row;
  filter.model_version = models_.applied;
  const Result<bool> replayed =
      journal.ForEach(filter, config_.machine.cell.robot.joints,
                      [this](const JournalRow& row) { Judge(row, true); });
  if (!replayed) return Fail(replayed.error());
  if (last_probe_s->has_value()) {
    const double behind_s = journal.EpochUtc_s() + **last_probe_s - ComputerUtcSeconds();
    if (behind_s > 1) {
      sink_(LogLevel::kWarning,
            fmt::format("the computer's clock is {:.0f} s behind the journal's last probe: one of "
                        "the two is wrong, and so are effects of time",
                        behind_s));
    }
  }
  journal_.emplace(std::move(journal));
  if (monitor_->alarm()) {
    sink_(LogLevel::kWarning,
          fmt::format("drift alarm of row {} of the journal still stands", alarm_row_));
    alarm_handled_ = alarm_handled_ || models_.proposed != 0;
  } else {
    alarm_handled_ = false;
  }
  Recovered();
}

bool LoopWorker::Take(const LoopEvent& event) {
  if (!journal_) return !config_.loop.enabled;
  return event.monitor_restart ? RestartMonitor("person") : Record(event);
}

bool LoopWorker::RestartMonitor(const char* reason) {
  const Result<bool> noted = journal_->NoteRestart(models_.applied, reason);
  if (!noted) {
    Fail(noted.error());
    return false;
  }
  monitor_->Restart();
  alarm_handled_ = false;
  sink_(LogLevel::kNotice, "drift monitor restarted by the PLC");
  return true;
}

bool LoopWorker::Record(const LoopEvent& event) {
  JournalRow row = RowFrom(event, config_.loop.session, journal_->EpochUtc_s());
  const std::vector<Joint>& joints = config_.machine.cell.robot.joints;
  if (row.q.size() != static_cast<Eigen::Index>(joints.size())) return true;  // of a former cell
  const Result<std::int64_t> id = journal_->Append({row}, joints);
  if (!id) {
    Fail(id.error());
    return false;
  }
  Recovered();
  row.id = *id;
  ++recorded_;
  last_residual_m_ = *row.measured_W - *row.predicted_W;
  if (event.model_version == models_.applied) Judge(row, false);
  return true;
}

void LoopWorker::Judge(const JournalRow& row, bool replayed) {
  if (!row.measured_W || !row.predicted_W || !row.measured_W->allFinite()) return;
  const bool was_learning = monitor_->learning();
  const ProbeVerdict verdict = monitor_->Update(*row.measured_W - *row.predicted_W);
  if (verdict.raised) alarm_row_ = row.id;
  if (replayed) return;
  if (verdict.wild || verdict.raised) {
    const Result<bool> marked = journal_->Mark(row.id, verdict.wild, verdict.raised);
    if (!marked) Fail(marked.error());
  }
  if (was_learning && !monitor_->learning()) {
    const Vec3 reference_mm = 1e3 * monitor_->reference_m();
    sink_(LogLevel::kNotice,
          fmt::format("drift monitor has its reference: residual ({:.3f}, {:.3f}, {:.3f}) mm, "
                      "scatter {:.3f} mm",
                      reference_mm.x(), reference_mm.y(), reference_mm.z(),
                      1e3 * monitor_->sigma_m()));
  }
  if (!verdict.raised) return;
  const DriftAlarm& alarm = *monitor_->alarm();
  const Vec3 shift_mm = 1e3 * ShiftOver(alarm);
  sink_(
      LogLevel::kWarning,
      fmt::format("drift alarm: the residual of probes changed by ({:.3f}, {:.3f}, {:.3f}) mm "
                  "within the last {} probes; row {} of the journal",
                  shift_mm.x(), shift_mm.y(), shift_mm.z(), alarm.probe - alarm.began + 1, row.id));
}

/// The change for a person to read: the median over the probes that took part. The monitor's own
/// estimate shortens each of them, and tells a change of millimetres too small.
Vec3 LoopWorker::ShiftOver(const DriftAlarm& alarm) {
  JournalFilter filter;
  filter.last = static_cast<std::int64_t>(alarm.probe - alarm.began + 1);
  filter.model_version = models_.applied;
  const auto rows = journal_->Read(filter, config_.machine.cell.robot.joints);
  if (!rows || rows->empty()) return alarm.shift_m;
  Vec3 shift_m;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const JournalRow& row : *rows) {
      if (row.measured_W && row.predicted_W) {
        values.push_back((*row.measured_W)[k] - (*row.predicted_W)[k]);
      }
    }
    if (values.empty()) return alarm.shift_m;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    shift_m[k] = *middle - monitor_->reference_m()[k];
  }
  return shift_m;
}

void LoopWorker::ConsiderDiagnosis() {
  if (!monitor_ || !monitor_->alarm() || alarm_handled_ || diagnosis_ || !config_.loop.diagnose) {
    return;
  }
  const std::uint64_t since = monitor_->probes() - monitor_->alarm()->began + 1;
  if (since < static_cast<std::uint64_t>(config_.loop.probes_before_diagnosis)) return;
  alarm_handled_ = true;
  const Result<std::size_t> rows = StartDiagnosis();
  diagnosis_failed_ = !rows;
  if (rows) {
    sink_(LogLevel::kNotice, fmt::format("diagnosis started over {} measured points", *rows));
    TellReadingError();
  } else {
    sink_(LogLevel::kError, "diagnosis not started: " + rows.error());
  }
}

/// Says how much of what is diagnosed the steps of the joint registers hide.
void LoopWorker::TellReadingError() {
  const CellModel& cell = config_.machine.cell;
  const LoadedArm arm(cell);
  double largest_rad = 0;
  std::vector<double> radii_m;
  for (const JournalRow& row : diagnosed_rows_) {
    if (row.q_step_rad.value_or(0) <= 0) continue;
    LoadedState state;
    arm.AtActual(row.q, {}, {}, state);
    largest_rad = std::max(largest_rad, *row.q_step_rad);
    radii_m.push_back(RadiusHolding95Percent(ReadingCovariance(arm, state, *row.q_step_rad)));
  }
  if (radii_m.empty()) return;
  const auto middle = radii_m.begin() + static_cast<std::ptrdiff_t>(radii_m.size() / 2);
  std::nth_element(radii_m.begin(), middle, radii_m.end());
  if (*middle < cell.measurement.sigma_m.value_or(config_.loop.probe_sigma_m)) return;
  sink_(LogLevel::kWarning,
        fmt::format("{} probes' joints are read to {:.2g} mrad = {:.2g} mm at the tool (95 %): it "
                    "counts as noise of the diagnosis, and effects below it cannot be seen; use "
                    "finer registers (universal-robots-fine)",
                    radii_m.size(), 1e3 * largest_rad, 1e3 * *middle));
}

Result<std::size_t> LoopWorker::StartDiagnosis() {
  JournalFilter filter;
  filter.last = kMostDiagnosedRows;
  const auto since = journal_->LastModel();
  if (!since) return Error{since.error()};
  if (since->has_value()) filter.after_id = (*since)->after_row;
  auto rows = journal_->Read(filter, config_.machine.cell.robot.joints);
  if (!rows) return Error{rows.error()};
  const ExportedCsv exported = CsvFromJournal(*rows, config_.machine.cell.robot.joints);
  const std::string folder = Folder(config_);
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  std::filesystem::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: {}", folder, error.message())};
  const Result<bool> written = WriteDurably(folder + "/measured.csv", exported.text);
  if (!written) return Error{written.error()};
  const Result<ModelStore> store = ModelStore::Open(config_.state_directory);
  if (!store || models_.applied == 0) return Error{"the model store cannot be used"};
  Result<DiagnosisProcess> started = DiagnosisProcess::Start(
      {PlumblineProgram(), "diagnose", store->ModelFile(models_.applied), folder + "/measured.csv",
       "--json", folder + "/diagnosis.json", "--write-model", folder + "/corrected.toml",
       "--report", folder + "/report.html", "--time-zero", TextFromUtc(journal_->EpochUtc_s())},
      folder + "/output.txt");
  if (!started) return Error{started.error()};
  diagnosis_.emplace(std::move(started).value());
  diagnosis_began_ = Clock::now();
  diagnosed_rows_ = std::move(rows).value();
  return exported.ids.size();
}

void LoopWorker::WatchDiagnosis() {
  if (!diagnosis_) return;
  const auto ended = diagnosis_->Poll();
  const std::chrono::duration<double> spent = Clock::now() - diagnosis_began_;
  if (!ended && spent.count() < config_.loop.diagnosis_timeout_s) return;
  diagnosis_.reset();
  std::string failure = ended ? *ended
                              : fmt::format("not done within loop.diagnosis_timeout_s = {:g} s",
                                            config_.loop.diagnosis_timeout_s);
  if (failure.empty()) {
    const Result<std::string> taken = TakeDiagnosis();
    if (taken) {
      sink_(LogLevel::kNotice, *taken);
    } else {
      failure = taken.error();
    }
  }
  diagnosis_failed_ = !failure.empty();
  if (diagnosis_failed_) {
    sink_(LogLevel::kError,
          fmt::format("diagnosis failed: {}; its files are in {}", failure, Folder(config_)));
  }
  diagnosed_rows_.clear();
}

/// Turns the files of a finished diagnosis into a proposal. @return the line to log
Result<std::string> LoopWorker::TakeDiagnosis() {
  const std::string folder = Folder(config_);
  const Result<std::string> json = ReadTextFile(folder + "/diagnosis.json");
  if (!json) return Error{"diagnosis.json: " + json.error()};
  Result<ModelFacts> read = ModelFactsFromDiagnosis(*json);
  if (!read) return Error{read.error()};
  ModelFacts facts = std::move(read).value();
  if (facts.verdict == "no_effect") {
    return std::string("diagnosis: no_effect, nothing stands out of the noise; nothing proposed");
  }
  const std::string errors =
      facts.rms_before_mm && facts.rms_after_mm
          ? fmt::format("held out {:.3f} -> {:.3f} mm", *facts.rms_before_mm, *facts.rms_after_mm)
          : "nothing was held out";
  const std::string what = fmt::format(
      "diagnosis: {} ({}), {}", facts.verdict,
      facts.effects.empty() ? "no effect" : fmt::format("{}", fmt::join(facts.effects, ", ")),
      errors);
  if (facts.rms_before_mm && facts.rms_after_mm && *facts.rms_after_mm >= *facts.rms_before_mm) {
    return what + "; nothing proposed";
  }
  const Result<std::string> model = ReadTextFile(folder + "/corrected.toml");
  if (!model) return Error{"corrected.toml: " + model.error()};
  FaultList faults;
  const auto cell = CellFromText(*model, folder + "/corrected.toml", faults);
  if (!cell) return Error{"the corrected model has faults: " + FaultsText(faults)};
  std::vector<ModelPose> poses;
  for (const JournalRow& row : diagnosed_rows_) {
    poses.push_back({row.session, row.q, row.payload_kg.value_or(0.0), row.t_s, row.temp_C});
  }
  const Result<double> change_m = LargestChange(config_.machine.cell, *cell, poses);
  if (change_m) facts.change_mm = 1e3 * *change_m;
  facts.from = fmt::format("drift alarm of row {} of the journal", alarm_row_);
  facts.based_on = models_.applied;

  Result<ModelStore> store = ModelStore::Open(config_.state_directory);
  if (!store) return Error{store.error()};
  const std::string report = folder + "/report.html";
  const Result<int> number =
      store.value().Propose(*model, facts, std::filesystem::exists(report) ? report : "");
  if (!number) return Error{number.error()};
  models_.proposed = *number;
  if (config_.loop.apply == LoopConfig::Apply::kAutomatic) {
    const std::string objection = WhyNotUsable(*cell).value_or(WhyNotAutomatic(facts));
    if (objection.empty()) {
      const Result<bool> applied = store.value().Apply(*number);
      if (!applied) return Error{applied.error()};
      reload_();
      return fmt::format("{}; version {} applied, as loop.apply says", what, *number);
    }
    return fmt::format("{}; version {} proposed, not applied: {}", what, *number, objection);
  }
  return fmt::format("{}; version {} proposed: `plumbline model apply {}`", what, *number, *number);
}

std::string LoopWorker::WhyNotAutomatic(const ModelFacts& facts) const {
  if (facts.verdict != "explained") return "the verdict is not \"explained\"";
  if (!facts.rms_before_mm || !facts.rms_after_mm) return "nothing was held out";
  if (!facts.change_mm) return "how far it moves the tip cannot be told";
  if (*facts.change_mm > 1e3 * config_.loop.max_change_m) {
    return fmt::format("it moves a tip by {:.3f} mm, loop.max_change_mm is {:g}", *facts.change_mm,
                       1e3 * config_.loop.max_change_m);
  }
  return {};
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
  PlcLoop told;
  const auto set = [&told](std::uint16_t bit, bool on) {
    if (on) told.state = static_cast<std::uint16_t>(told.state | bit);
  };
  set(loop_state::kRecording, journal_.has_value());
  set(loop_state::kAlarm, monitor_ && monitor_->alarm());
  set(loop_state::kProposalWaiting, models_.proposed != 0);
  set(loop_state::kLearning, monitor_ && monitor_->learning());
  set(loop_state::kDiagnosing, diagnosis_.has_value());
  set(loop_state::kFault, !fault_.empty() || diagnosis_failed_);
  told.applied = models_.applied;
  told.proposed = models_.proposed;
  told.declared = models_.declared;
  told.probes = recorded_;
  told.statistic = monitor_ ? monitor_->statistic() : 0;
  told.residual_m = last_residual_m_;
  link_.told.Begin() = told;
  link_.told.Publish();
}

void LoopWorker::Fail(const std::string& what) {
  if (fault_ != what) sink_(LogLevel::kError, "journal: " + what);
  fault_ = what;
}

void LoopWorker::Recovered() {
  if (!fault_.empty()) sink_(LogLevel::kNotice, "journal works again");
  fault_.clear();
}

}  // namespace plumbline
