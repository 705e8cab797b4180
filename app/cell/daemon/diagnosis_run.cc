#include "app/cell/daemon/diagnosis_run.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "app/base/config/cell_reader.h"
#include "app/base/service/utc_clock.h"
#include "app/base/text/text.h"
#include "app/cell/daemon/row_drift_monitor.h"
#include "app/cell/journal/journal_csv.h"
#include "app/cell/model_store/model_change.h"
#include "app/cell/model_store/model_json.h"
#include "app/cell/model_store/point_moves.h"
#include "app/cell/model_store/usable_model.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/package_paths.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/deflection/uncertainty.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::cell {
namespace {

constexpr int kLowestPriority = 19;  ///< the highest nice value

/// The last non-empty line of a file, at most 300 characters.
std::string LastLine(const std::string& file) {
  std::ifstream input(file);
  std::string line, last;
  while (std::getline(input, line)) {
    if (!line.empty()) last = line;
  }
  return last.substr(0, 300);
}

}  // namespace

Result<DiagnosisProcess> DiagnosisProcess::Start(const std::vector<std::string>& arguments,
                                                 const std::string& output_file) {
  const os::Descriptor output(open(
      output_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!output) {
    return Error{fmt::format("{}: {}", output_file,
                             files::WriteErrorText(output_file, std::strerror(errno)))};
  }
  auto child = os::ChildProcess::Start(
      {.arguments = arguments,
       .descriptors = {{STDOUT_FILENO, output.get()}, {STDERR_FILENO, output.get()}},
       .nice = kLowestPriority,
       .own_group = true});
  if (!child) return Error{fmt::format("cannot create a process: {}", child.error())};
  return DiagnosisProcess(std::move(child).value(), output_file);
}

std::optional<std::string> DiagnosisProcess::Poll() {
  if (!child_.started()) return "was stopped";
  const std::optional<os::ExitStatus> end = child_.Poll();
  if (!end) return std::nullopt;
  if (end->ok()) return std::string();
  std::string how = "exit status unknown";
  if (end->exit_code) how = fmt::format("exit code {}", *end->exit_code);
  if (end->signal != 0) how = fmt::format("signal {}", end->signal);
  std::string last_line = LastLine(output_file_);
  if (last_line.empty() && end->exit_code == os::ExitStatus::kNotRun) last_line = "cannot be run";
  return last_line.empty() ? how : fmt::format("{}: {}", how, last_line);
}

namespace {

constexpr std::int64_t kMaxDiagnosedRows = 12000;  // the newest; they take about a minute

std::string Folder(const config::DaemonConfig& config) {
  return config.state_directory + "/diagnosis";
}

/// Logs the tip error due to coarse joint registers if it exceeds the measurement noise.
void LogReadingError(const config::DaemonConfig& config, const std::vector<JournalRow>& rows,
                     const log::LogSink& sink, const std::function<void()>& step) {
  const model::CellModel& cell = config.machine.cell;
  const deflection::LoadedArm arm(cell);
  double largest_rad = 0;
  std::vector<double> radii_m;
  for (const JournalRow& row : rows) {
    if (row.q_step_rad.value_or(0) <= 0) continue;
    step();
    deflection::LoadedState state;
    arm.AtActual(row.q, {}, {}, state);
    largest_rad = std::max(largest_rad, *row.q_step_rad);
    radii_m.push_back(statistics::RadiusHolding95Percent(
        deflection::ReadingCovariance(arm, state, *row.q_step_rad)));
  }
  if (radii_m.empty()) return;
  const double middle_m = statistics::MedianOf(radii_m);
  if (middle_m < cell.measurement.sigma_m.value_or(config.monitoring.probe_sigma_m)) return;
  sink(
      {log::Event::kDiagnosisCoarse,
       fmt::format("the joint readings of {} probes have a resolution of {:.2g} mrad, {:.2g} mm at "
                   "the tool (95 %). The diagnosis treats this as noise and cannot detect smaller "
                   "effects. Use finer "
                   "registers (universal-robots-fine)",
                   radii_m.size(), 1e3 * largest_rad, 1e3 * middle_m)});
}

/// The smallest and the largest mass that was carried.
std::vector<ReportedLoad> Loads(const std::vector<JournalRow>& rows) {
  std::vector<double> masses_kg;
  for (const JournalRow& row : rows) {
    if (row.payload_kg) masses_kg.push_back(*row.payload_kg);
  }
  if (masses_kg.empty()) return {};
  const auto [least, most] = std::minmax_element(masses_kg.begin(), masses_kg.end());
  return {{*least, std::nullopt}, {*most, std::nullopt}};
}

}  // namespace

Result<DiagnosisRun> DiagnosisRun::Start(const config::DaemonConfig& config, int applied_model,
                                         Journal& journal, std::string cause,
                                         const log::LogSink& sink,
                                         const std::function<void()>& step) {
  JournalFilter filter;
  filter.last = kMaxDiagnosedRows;
  const auto since = journal.LastModel();
  if (!since) return since.failure();
  if (since->has_value()) filter.after_id = (*since)->after_row;
  auto rows = journal.Read(filter, config.machine.cell.robot.joints);
  if (!rows) return rows.failure();
  step();
  const double sigma_m = config.monitoring.probe_sigma_m;
  const std::size_t uncertain = std::erase_if(
      rows.value(), [&](const JournalRow& row) { return IsTooUncertain(row, sigma_m); });
  if (uncertain > 0) {
    sink({log::Event::kDiagnosisNote,
          fmt::format("diagnosis: {} camera probes left out: less certain than "
                      "monitoring.probe_sigma_mm",
                      uncertain)});
  }
  const ExportedCsv exported = CsvFromJournal(*rows, config.machine.cell.robot.joints);
  for (const std::string& note : exported.notes)
    sink({log::Event::kDiagnosisNote, "diagnosis: " + note});
  std::erase_if(rows.value(), [&exported](const JournalRow& row) {
    return !std::binary_search(exported.ids.begin(), exported.ids.end(), row.id);
  });
  step();
  const std::string folder = Folder(config);
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  std::filesystem::create_directories(folder, error);
  if (error)
    return Error{fmt::format("{}: {}", folder, files::WriteErrorText(folder, error.message()))};
  const Result<void> written = files::ReplaceFileDurably(folder + "/measured.csv", exported.text);
  if (!written) return written.failure();
  step();
  const Result<ModelStore> store = ModelStore::Open(config.state_directory);
  if (!store || applied_model == 0) return Error{"the model store cannot be used"};
  Result<DiagnosisProcess> started = DiagnosisProcess::Start(
      {files::PlumblineProgram(), "diagnose", store->ModelFile(applied_model),
       folder + "/measured.csv", "--json", folder + "/diagnosis.json", "--write-model",
       folder + "/corrected.toml", "--report", folder + "/report.html", "--time-zero",
       text::TextFromUtc(journal.EpochUtc_s()), "--order-unknown"},
      folder + "/output.txt");
  if (!started) return started.failure();
  sink({log::Event::kDiagnosisStarted,
        fmt::format("diagnosis started over {} measured points", exported.ids.size())});
  LogReadingError(config, *rows, sink, step);
  return DiagnosisRun(std::move(started).value(), applied_model, std::move(cause),
                      std::move(rows).value());
}

std::optional<DiagnosisRun::Outcome> DiagnosisRun::Poll(const config::DaemonConfig& config,
                                                        const std::function<void()>& step) {
  const auto ended = process_.Poll();
  const std::chrono::duration<double> spent = Clock::now() - started_;
  Outcome outcome;
  if (!ended) {
    if (spent.count() < config.monitoring.diagnosis_timeout_s) return std::nullopt;
    process_.Kill();
    outcome.failure = fmt::format("not finished within monitoring.diagnosis_timeout_s = {:g} s",
                                  config.monitoring.diagnosis_timeout_s);
  } else if (!ended->empty()) {
    outcome.failure = *ended;
  } else {
    const Result<Outcome> proposed = Propose(config, step);
    if (proposed) return *proposed;
    outcome.failure = proposed.error();
  }
  outcome.message =
      fmt::format("diagnosis failed: {}; see the files in {}", outcome.failure, Folder(config));
  return outcome;
}

/// Reads the files of a finished diagnosis, and proposes or applies the corrected model.
Result<DiagnosisRun::Outcome> DiagnosisRun::Propose(const config::DaemonConfig& config,
                                                    const std::function<void()>& step) const {
  const std::string folder = Folder(config);
  const Result<std::string> json =
      files::ReadFileUpTo(files::kTableSize, folder + "/diagnosis.json");
  if (!json) return Error{"diagnosis.json: " + json.error()};
  Result<ModelFacts> read = ModelFactsFromDiagnosis(*json);
  if (!read) return read.failure();
  ModelFacts facts = std::move(read).value();
  Outcome outcome;
  if (facts.verdict == "no_effect") {
    outcome.message = "diagnosis: no_effect, no effect exceeds the noise; nothing proposed";
    return outcome;
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
    outcome.message = what + "; nothing proposed";
    return outcome;
  }
  const Result<std::string> model = files::ReadTextFile(folder + "/corrected.toml");
  if (!model) return Error{"corrected.toml: " + model.error()};
  config::FaultList faults;
  const auto cell = config::CellFromText(*model, folder + "/corrected.toml", faults);
  if (!cell) {
    return Error{fmt::format("the corrected model has faults ({}), first: {}", faults.All().size(),
                             faults.All().empty() ? "" : config::FaultText(faults.All().front()))};
  }
  std::vector<ModelPose> poses;
  for (const JournalRow& row : rows_) {
    poses.push_back({row.q, row.payload_kg.value_or(0.0), row.t_s, row.temp_C,
                     loads::ToolIndexOf(config.machine.cell, row.tool_number).value_or(0)});
  }
  step();
  const Result<double> change_m = LargestTipChange(config.machine.cell, *cell, poses);
  if (change_m) facts.change_mm = 1e3 * *change_m;
  const PointMoves moves = ComputePointMoves(config.machine, config.machine.cell, *cell,
                                             service::SystemUtcSeconds(), Loads(rows_), step);
  const std::string objections = fmt::format("{}", fmt::join(Objections(moves), "; "));
  const bool all_compared = std::all_of(moves.all.begin(), moves.all.end(),
                                        [](const PointMove& move) { return move.Compared(); });
  if (const PointMove* const largest = moves.Largest(); largest != nullptr && all_compared) {
    facts.points_change_mm = 1e3 * largest->Distance_m();
  }
  facts.from = cause_;
  facts.based_on = applied_model_;

  step();
  Result<ModelStore> store = ModelStore::Open(config.state_directory);
  if (!store) return store.failure();
  const std::string report = folder + "/report.html";
  const Result<int> number =
      store.value().Propose(*model, facts, std::filesystem::exists(report) ? report : "");
  if (!number) return number.failure();
  outcome.proposed = *number;
  if (config.monitoring.apply != config::MonitoringConfig::Apply::kAutomatic) {
    outcome.message =
        fmt::format("{}; version {} proposed: {}{}", what, *number,
                    ModelCommand(fmt::format("apply {}", *number), config.state_directory),
                    objections.empty() ? "" : " will be refused without --force: " + objections);
    return outcome;
  }
  const bool has_points = !config.machine.points.empty();
  std::string objection = ModelUnusableReason(*cell).value_or(
      AutomaticApplyObjection(facts, config.monitoring, has_points));
  if (objection.empty()) objection = objections;
  if (!objection.empty()) {
    outcome.message =
        fmt::format("{}; version {} proposed, not applied: {}", what, *number, objection);
    return outcome;
  }
  const Result<void> applied = store.value().Apply(*number);
  if (!applied) return applied.failure();
  outcome.applied = true;
  outcome.message = fmt::format("{}; version {} applied (monitoring.apply)", what, *number);
  return outcome;
}

std::string AutomaticApplyObjection(const ModelFacts& facts,
                                    const config::MonitoringConfig& monitoring, bool has_points) {
  if (facts.verdict != "explained") return "the verdict is not \"explained\"";
  if (!facts.rms_before_mm || !facts.rms_after_mm) return "nothing was held out";
  if (!facts.implausible.empty()) {
    return fmt::format("implausible on a healthy machine: {}", fmt::join(facts.implausible, "; "));
  }
  if (facts.discrepancy_share) {
    return fmt::format("{:.0f} % of the correction is not explained by a named effect",
                       100 * *facts.discrepancy_share);
  }
  if (!facts.change_mm) return "how far it moves the tip cannot be computed";
  if (*facts.change_mm > 1e3 * monitoring.max_change_m) {
    return fmt::format("it moves a tip by {:.3f} mm, monitoring.max_change_mm is {:g}",
                       *facts.change_mm, 1e3 * monitoring.max_change_m);
  }
  if (!has_points) return {};
  if (!facts.points_change_mm) {
    return "how far it moves the configured points is not known: one of them cannot be "
           "corrected";
  }
  if (*facts.points_change_mm > 1e3 * monitoring.max_change_m) {
    return fmt::format("it moves a configured point by {:.3f} mm, monitoring.max_change_mm is {:g}",
                       *facts.points_change_mm, 1e3 * monitoring.max_change_m);
  }
  return {};
}

}  // namespace plumbline::cell
