#include "app/plant/jobs/job_run.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "app/base/text/json_integer.h"
#include "app/base/text/json_text.h"
#include "app/base/text/sha256.h"
#include "app/base/text/text.h"
#include "app/plant/jobs/cell_data.h"
#include "drivers/clock.h"
#include "drivers/files/text_file.h"
#include "drivers/os/descriptor.h"
#include "drivers/os/run_program.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;

constexpr int kNice = 10;           ///< other programs of the machine go first
constexpr int kRefused = 1;         ///< exit code of a program that could not use its input
constexpr std::size_t kTail = 600;  ///< characters of what a failed program printed
constexpr std::size_t kShaDigits = 12;
constexpr files::SizeLimit kProgramSize{std::size_t{1} << 30, "a program", "Check the path"};
constexpr const char *kPrinted = "printed.txt", *kCellFile = "cell.toml",
                     *kRowsFile = "measured.csv", *kArmFile = "arm.json",
                     *kSizesFile = "sizes.json", *kDiagnose = "diagnose", *kNoPrior = "--no-prior";

/// The end of what the program printed, on one line.
std::string Tail(const std::string& file) {
  const auto read = files::ReadFileUpTo(files::kTableSize, file);
  std::string text = read ? *read : "";
  if (text.size() > kTail) text.erase(0, text.size() - kTail);
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text::Visible(text);
}

std::string MemberText(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

std::optional<std::int64_t> WholeMember(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? std::nullopt : text::IntegerFromJsonIfValid<std::int64_t>(*found);
}

/// Number of a cell and its topics.
Result<CellName> CellNumbered(Connection& connection, int number) {
  const auto found = connection.Run("SELECT line, node FROM cell WHERE cell = $1", {number});
  if (!found) return found.failure();
  if (found->empty()) return Error{fmt::format("the database has no cell {}", number)};
  return CellName{number, std::string(found->Text(0, 0)), std::string(found->Text(0, 1))};
}

RowSelection SelectionFrom(const json& input) {
  RowSelection selection;
  selection.since = MemberText(input, "since");
  selection.until = MemberText(input, "until");
  selection.last = WholeMember(input, "last");
  return selection;
}

/// Sizes of an arm as the diagnosis of an earlier job wrote them.
Result<std::string> ReadArm(Connection& connection, const json& input) {
  const auto found = connection.Run("SELECT output - 'plant' FROM result WHERE job = $1",
                                    {WholeMember(input, "arm_job").value_or(0)});
  if (!found) return found.failure();
  if (found->empty()) return Error{"the diagnosis of the arm is missing"};
  return std::string(found->Text(0, 0));
}

/// The command line of a stage, and where it answers.
void SetCommand(const std::string& stage, const std::string& cell, const std::string& time_zero,
                JobTask& task) {
  const auto file = [&task](const char* name) { return task.folder.File(name); };
  task.output_file = file("answer.json");
  if (stage == kFitStage) {
    task.arguments = {"prior",     "fit", file(kArmFile), file(kRowsFile), file(kSizesFile),
                      "--threads", "1",   "--out",        task.output_file};
    return;
  }
  task.arguments = {kDiagnose, file(kCellFile),   file(kRowsFile), "--time-zero",
                    time_zero, "--order-unknown", "--threads",     "1",
                    "--quiet"};
  const bool arm = stage == kArmStage;
  task.arguments.insert(task.arguments.end(), {arm ? "--arm-out" : "--json", task.output_file});
  if (arm) task.arguments.insert(task.arguments.end(), {"--arm-name", cell});
}

}  // namespace

Result<JobProgram> IdentifyProgram(const std::string& path) {
  const auto run = os::RunProgram({path, "--version"}, "");
  if (!run) return Error{fmt::format("{}: {}", path, run.error())};
  if (!run->end.ok()) {
    return Error{fmt::format("{} --version failed: {}; give the path of a program plumbline", path,
                             run->end.exit_code == os::ExitStatus::kNotRun
                                 ? "it cannot be run"
                                 : text::Visible(run->errors))};
  }
  const auto bytes = files::ReadFileUpTo(kProgramSize, path);
  if (!bytes) return Error{fmt::format("{}: {}", path, bytes.error())};
  const std::string printed = text::Visible(run->output.substr(0, run->output.find('\n')));
  const auto help = os::RunProgram({path, kDiagnose, "--help"}, "");
  return JobProgram{path,
                    fmt::format("{}, {}", printed, text::Sha256Hex(*bytes).substr(0, kShaDigits)),
                    help && help->output.find(kNoPrior) != std::string::npos};
}

Result<JobFolder> JobFolder::Create() {
  std::error_code error;
  std::string path =
      (std::filesystem::temp_directory_path(error) / "plumbline-job-XXXXXX").string();
  if (mkdtemp(path.data()) != nullptr) return JobFolder(std::move(path));
  return Error{fmt::format("{}: {}; check its permissions, or set TMPDIR to another folder", path,
                           std::strerror(errno))};
}

JobFolder& JobFolder::operator=(JobFolder&& other) noexcept {
  Remove();
  path_ = std::move(other.path_);
  return *this;
}

void JobFolder::Remove() {
  std::error_code ignored;
  if (path_) std::filesystem::remove_all(*path_, ignored);
  path_.reset();
}

Result<JobTask> PrepareJob(Connection& connection, const TakenJob& job) {
  if (!job.cell) return Error{fmt::format("a job of kind {} needs a cell", job.kind)};
  const auto cell = CellNumbered(connection, *job.cell);
  if (!cell) return cell.failure();
  const auto file = ReadCellFile(connection, *cell, MemberText(job.input, "file_utc"),
                                 MemberText(job.input, "fingerprint"));
  if (!file) return file.failure();
  const auto rows = ReadCellRows(connection, *cell, file->toml, SelectionFrom(job.input));
  if (!rows) return rows.failure();
  auto folder = JobFolder::Create();
  if (!folder) return folder.failure();
  JobTask task{std::move(folder).value(), {}, "", {}};
  std::vector<std::pair<const char*, std::string>> files = {{kCellFile, file->toml},
                                                            {kRowsFile, rows->csv}};
  const std::string stage = MemberText(job.input, "stage");
  if (stage == kFitStage) {
    const auto arm = ReadArm(connection, job.input);
    if (!arm) return arm.failure();
    files.emplace_back(kArmFile, *arm);
    const auto sizes = job.input.find("sizes");
    files.emplace_back(kSizesFile, sizes == job.input.end() ? "" : text::JsonText(*sizes));
  }
  for (const auto& [name, text] : files) {
    const auto written = files::WriteTextFile(task.folder.File(name), text);
    if (!written) return Error{fmt::format("{}: {}", task.folder.File(name), written.error())};
  }
  SetCommand(stage, cell->Text(), text::TextFromUtc(rows->time_zero_utc_s), task);
  task.origin = {{"cell", cell->Text()},
                 {"rows", rows->rows},
                 {"data_sha256", text::Sha256Hex(file->toml + rows->csv)},
                 {"notes", rows->notes}};
  return task;
}

Result<JobRun> JobRun::Start(const JobProgram& program, JobTask task, const JobLimits& limits) {
  const os::Descriptor printed(
      open(task.folder.File(kPrinted).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  std::vector<std::string> arguments = {program.path};
  arguments.insert(arguments.end(), task.arguments.begin(), task.arguments.end());
  // The answer must not depend on the machine.
  if (program.has_no_prior && task.arguments.front() == kDiagnose) arguments.push_back(kNoPrior);
  auto child = os::ChildProcess::Start(
      {.arguments = std::move(arguments),
       .descriptors = {{STDOUT_FILENO, printed.get()}, {STDERR_FILENO, printed.get()}},
       .nice = kNice,
       .memory_bytes = limits.memory_bytes,
       .own_group = true});
  if (!child) return Error{fmt::format("cannot create a process: {}", child.error())};
  return JobRun(std::move(task), std::move(child).value(), limits, MonotonicSeconds());
}

std::optional<JobOutcome> JobRun::Poll() {
  const double seconds = MonotonicSeconds() - started_s_;
  JobOutcome outcome;
  if (const auto end = child_.Poll()) {
    outcome = OutcomeOf(*end);
  } else if (seconds > limits_.time_s) {
    child_.End();
    outcome.text =
        fmt::format("not finished within {:g} s, the --timeout-s of the worker", limits_.time_s);
  } else {
    return std::nullopt;
  }
  outcome.seconds = seconds;
  return outcome;
}

JobOutcome JobRun::OutcomeOf(const os::ExitStatus& end) const {
  const std::string printed = Tail(task_.folder.File(kPrinted));
  if (end.exit_code == kRefused) {
    return {true, text::JsonText(json{{"refused", printed}, {"plant", task_.origin}})};
  }
  if (!end.ok()) {
    const std::string how = end.exit_code ? fmt::format("exit code {}", *end.exit_code)
                                          : fmt::format("killed by signal {}", end.signal);
    return {false, printed.empty() ? how : how + ": " + printed};
  }
  const auto answer = files::ReadFileUpTo(files::kTableSize, task_.output_file);
  if (!answer) return {false, "no answer was written: " + answer.error()};
  auto output = text::JsonFromText(*answer);
  if (!output || !output->is_object()) return {false, "the answer is not a JSON object"};
  json object = std::move(output).value();
  object["plant"] = task_.origin;
  return {true, text::JsonText(object)};
}

}  // namespace plumbline::plant
