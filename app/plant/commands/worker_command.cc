#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <thread>

#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/plant/commands/job_progress.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/worker.h"
#include "drivers/clock.h"
#include "drivers/files/package_paths.h"

namespace plumbline::plant {
namespace {

struct WorkerArguments {
  DatabaseOptions database;
  std::vector<std::string> programs;
  int jobs = 1, memory_mb = 4096;
  double timeout_s = 1800, lease_s = 60;
  bool once = false;
};

constexpr double kHeartbeat_s = 1;

/// Notifies the service manager's watchdog while the worker's loop runs, and writes the log.
class WorkerHeartbeat {
 public:
  explicit WorkerHeartbeat(const service::ServiceManager& manager) : manager_(manager) {}
  void operator()() {
    if (MonotonicSeconds() < next_s_) return;
    manager_.NotifyWatchdog();
    log::FlushLog();
    next_s_ = MonotonicSeconds() + kHeartbeat_s;
  }

 private:
  const service::ServiceManager& manager_;
  double next_s_ = 0;
};

int Work(const WorkerArguments& arguments) {
  const service::ServiceManager manager;
  const auto database = ConnectionText(arguments.database);
  if (!database) return kExitFault;
  // A service waits for its database; a single run reports that there is none.
  if (arguments.once && !OpenDatabase(arguments.database)) return kExitFault;
  WorkerOptions options;
  options.database = *database;
  options.slots = arguments.jobs;
  options.once = arguments.once;
  options.lease_s = arguments.lease_s;
  options.limits = {arguments.timeout_s, static_cast<std::size_t>(arguments.memory_mb) << 20};
  for (const std::string& path : arguments.programs) {
    auto program = IdentifyProgram(path);
    if (!program) return FailCommand(program.error());
    options.programs.push_back(std::move(program).value());
    std::cerr << fmt::format("{}: version {}\n", path, options.programs.back().version);
  }
  options.heartbeat = WorkerHeartbeat(manager);
  const os::Descriptor stop(service::OpenSignalDescriptor());
  manager.Ready(fmt::format("{} jobs at a time", options.slots));
  Worker worker(std::move(options), log::Log);
  log::Log({log::Event::kWorkerStarted, fmt::format("plumbline plant worker {}, {} jobs at a time",
                                                    worker.name(), arguments.jobs)});
  worker.Run(stop.get());
  manager.Stopping();
  log::FlushLog(true);
  std::cout << fmt::format("{} jobs done, {} attempts failed\n", worker.answered(),
                           worker.failed());
  return arguments.once && (worker.failed() > 0 || !worker.was_usable()) ? kExitFault : kExitOk;
}

}  // namespace

void AddWorkerCommand(CLI::App& app, int& exit_code) {
  const auto arguments = std::make_shared<WorkerArguments>();
  arguments->programs = {files::PlumblineProgram()};
  arguments->jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  CLI::App* const command =
      app.add_subcommand("worker", "Take queued jobs and do them, on this machine");
  AddDatabaseOptions(*command, arguments->database);
  command->add_flag("--once", arguments->once, "End when no job is left to take");
  command->add_option("--jobs", arguments->jobs, "Jobs at the same time, each with one thread")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--program", arguments->programs,
                   "Programs `plumbline` that do the work; the first does jobs for any version")
      ->default_str("the one beside this program");
  command->add_option("--timeout-s", arguments->timeout_s, "Longest time of a job")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e6));
  command->add_option("--memory-mb", arguments->memory_mb, "Largest memory of a job")
      ->capture_default_str()
      ->check(CLI::Range(64, 1'000'000));
  command
      ->add_option("--lease-s", arguments->lease_s,
                   "After so long without a sign of life, others take this worker's jobs")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 3600.0));
  command->footer(
      "Any number of workers may run, on any machine that reaches the database. A job that fails\n"
      "three times is marked as failed, with the reason. SIGTERM hands running jobs back.\n\n"
      "Examples:\n"
      "  plumbline plant worker --once\n"
      "  plumbline plant worker --program /usr/bin/plumbline /opt/new/bin/plumbline\n\n"
      "Exit codes: 0 stopped by SIGTERM or SIGINT, or the queue was empty; 1 no database or "
      "program,\nor an attempt failed with --once; 2 wrong arguments.");
  command->callback([arguments, &exit_code] { exit_code = Work(*arguments); });
}

}  // namespace plumbline::plant
