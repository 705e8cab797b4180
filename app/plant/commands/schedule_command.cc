#include <fmt/format.h>

#include <algorithm>
#include <iostream>

#include "app/plant/commands/job_progress.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/cell_work.h"
#include "app/plant/jobs/job_run.h"

namespace plumbline::plant {
namespace {

struct ScheduleOptions {
  DatabaseOptions database;
  std::string kind = "diagnose", version;
  WorkSelection selection;
};

/// Number of the newest job; those added later have larger ones.
Result<std::int64_t> LastJob(Connection& connection) {
  return connection.Run("SELECT coalesce(max(job), 0) FROM job").transform([](const Rows& rows) {
    return rows.Integer(0, 0);
  });
}

int Schedule(const ScheduleOptions& options) {
  auto connection = OpenDatabase(options.database);
  if (!connection) return kExitFault;
  auto list = FindWork(*connection, options.selection);
  if (!list) return FailCommand(list.error());
  const auto before = LastJob(*connection);
  if (!before) return FailCommand(before.error());
  const bool prior = options.kind == "prior";
  if (prior) {
    for (CellWork& one : list.value().work) one.input["stage"] = kArmStage;
  }
  const auto jobs = AddCellJobs(*connection, options.kind, options.version,
                                options.selection.arm_model, list->work);
  if (!jobs) return FailCommand(jobs.error());
  PrintLeftOut(list->left_out);
  const auto added = std::count_if(jobs->begin(), jobs->end(),
                                   [&before](std::int64_t job) { return job > *before; });
  std::cout << fmt::format("{} jobs added, {} cells unchanged since an earlier job, {} left out\n",
                           added, static_cast<std::ptrdiff_t>(jobs->size()) - added,
                           list->left_out.size());
  return kExitOk;
}

}  // namespace

void AddScheduleCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ScheduleOptions>();
  CLI::App* const command =
      app.add_subcommand("schedule", "Queue a diagnosis of every cell for the workers");
  AddDatabaseOptions(*command, options->database);
  command
      ->add_option("--kind", options->kind,
                   "diagnose; compare, for a --program-version; prior, what `prior` needs")
      ->capture_default_str()
      ->check(CLI::IsMember({"diagnose", "compare", "prior"}));
  command->add_option("--cells", options->selection.cells, "Only these, LINE/NODE; default: all");
  command->add_option("--arm-model", options->selection.arm_model, "Only cells with this arm");
  command->add_option("--last", options->selection.last, "Rows of a cell at most, the newest")
      ->capture_default_str()
      ->check(CLI::Range(std::int64_t{kMinRows}, std::int64_t{100'000}));
  command->add_option("--program-version", options->version,
                      "Only workers with this version take the jobs, as `worker` prints it");
  command->footer(
      "A cell is diagnosed from the rows since its model came into force. Nothing is added for a\n"
      "cell without a new probe or model since its last job, so that the command may be repeated.\n"
      "The service plumbline-plant-schedule runs it every night.\n\n"
      "Examples:\n"
      "  plumbline plant schedule\n"
      "  plumbline plant schedule --cells line-2/cell-7 line-2/cell-8\n\n"
      "Exit codes: 0 queued, or nothing to do; 1 no database, or no such cell; 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Schedule(*options); });
}

}  // namespace plumbline::plant
