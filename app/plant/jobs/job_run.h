// Run of one job: a child process in a temporary folder, with limits on its time and memory.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/plant/jobs/job_queue.h"
#include "drivers/os/child_process.h"

namespace plumbline::plant {

/// A program `plumbline` that does the work, and the version that jobs name it by.
struct JobProgram {
  std::string path;
  /// "0.1.0, build 1f3a5c7e9b0d of 2026-11-28, 0a1b2c3d4e5f": what --version prints, and the start
  /// of the file's SHA-256, since two builds may print the same.
  std::string version;
  /// Diagnoses without the priors installed on the worker's machine if told so. A version without
  /// this option knows no priors.
  bool has_no_prior = false;
};

/// Runs the program with --version, and reads what options its diagnosis has.
Result<JobProgram> IdentifyProgram(const std::string& path);

struct JobLimits {
  double time_s = 1800;
  std::size_t memory_bytes = std::size_t{4} << 30;
};

/// How a job ended.
struct JobOutcome {
  bool answered = false;  ///< `text` is JSON; otherwise the reason, and the job may be tried again
  std::string text;
  double seconds = 0;
};

/// A folder that is removed with its owner.
class JobFolder {
 public:
  JobFolder() = default;
  static Result<JobFolder> Create();
  JobFolder(JobFolder&&) noexcept = default;
  JobFolder& operator=(JobFolder&& other) noexcept;
  ~JobFolder() { Remove(); }
  std::string File(const std::string& name) const { return *path_ + "/" + name; }

 private:
  explicit JobFolder(std::string path) : path_(std::make_unique<std::string>(std::move(path))) {}
  void Remove();
  std::unique_ptr<std::string> path_;
};

/// What a job's program is given, and where it answers.
struct JobTask {
  JobFolder folder;                    ///< holds its files
  std::vector<std::string> arguments;  ///< without the program
  std::string output_file;             ///< JSON, written by the program
  nlohmann::json origin;               ///< what it worked on; stored with the answer as "plant"
};

/// `stage` in the input of a job of kind "prior": diagnose the arm and write what its siblings need
/// of it, or fit the sizes that the arms of its model share. Other jobs have none: a diagnosis.
inline constexpr const char *kArmStage = "arm", *kFitStage = "fit";

/// Reads what a job needs from the database.
/// @return  the reason, which is final for these rows if the connection is still alive
Result<JobTask> PrepareJob(Connection& connection, const TakenJob& job);

/// A running job. Used by one thread, with whose end the child is killed.
class JobRun {
 public:
  static Result<JobRun> Start(const JobProgram& program, JobTask task, const JobLimits& limits);
  /// How it ended, once; nullopt while it runs. An input that the program refuses (exit code 1) is
  /// an answer: {"refused": reason}. A program that exceeds a limit is killed.
  std::optional<JobOutcome> Poll();

 private:
  JobRun(JobTask task, os::ChildProcess child, JobLimits limits, double started_s)
      : task_(std::move(task)), child_(std::move(child)), limits_(limits), started_s_(started_s) {}
  JobOutcome OutcomeOf(const os::ExitStatus& end) const;

  JobTask task_;
  os::ChildProcess child_;
  JobLimits limits_;
  double started_s_;
};

}  // namespace plumbline::plant
