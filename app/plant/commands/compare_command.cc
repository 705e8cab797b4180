#include <fmt/format.h>

#include <iostream>

#include "app/base/text/json_text.h"
#include "app/plant/commands/job_progress.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/comparison.h"
#include "app/plant/jobs/job_run.h"

namespace plumbline::plant {
namespace {

constexpr const char* kStored = "stored";

struct CompareOptions {
  DatabaseOptions database;
  std::string program, against = kStored, json;
  WorkSelection selection;
  bool no_wait = false;
};

/// Both answers of each cell are those of a job.
struct JobPairs {
  std::vector<std::string> cells;
  std::vector<std::int64_t> old_jobs, new_jobs;
  std::vector<std::string> left_out;
};

/// The newest stored diagnosis of each cell, by a version other than `version`: its rows are
/// diagnosed again.
constexpr const char* kNewestStored = R"sql(
SELECT DISTINCT ON (c.line, c.node) c.cell, c.line, c.node, j.job, j.input
FROM job j JOIN result r USING (job) JOIN cell c ON c.cell = j.cell
WHERE j.kind IN ('diagnose', 'compare') AND r.program <> $1
  AND (cardinality($2::text[]) = 0 OR c.line || '/' || c.node = ANY($2))
ORDER BY c.line, c.node, j.job DESC
)sql";

Result<JobPairs> PairsWithStored(Connection& connection, const CompareOptions& options,
                                 const JobProgram& program) {
  ArrayText wanted;
  for (const std::string& cell : options.selection.cells) wanted.Add(cell);
  const auto stored = connection.Run(kNewestStored, {program.version, wanted.Text()});
  if (!stored) return stored.failure();
  JobPairs pairs;
  std::vector<CellWork> work;
  for (int k = 0; k < stored->size(); ++k) {
    const CellName cell{static_cast<int>(stored->Integer(k, 0)), std::string(stored->Text(k, 1)),
                        std::string(stored->Text(k, 2))};
    pairs.cells.push_back(cell.Text());
    pairs.old_jobs.push_back(stored->Integer(k, 3));
    work.push_back({cell, text::JsonOrNull(stored->Text(k, 4))});
  }
  auto jobs = AddCellJobs(connection, "compare", program.version, std::nullopt, work);
  if (!jobs) return jobs.failure();
  pairs.new_jobs = std::move(jobs).value();
  return pairs;
}

Result<JobPairs> PairsWithProgram(Connection& connection, const CompareOptions& options,
                                  const JobProgram& program) {
  const auto other = IdentifyProgram(options.against);
  if (!other) return other.failure();
  if (other->version == program.version) {
    return Error{fmt::format("{} and {} are the same program", options.program, options.against)};
  }
  auto list = FindWork(connection, options.selection);
  if (!list) return list.failure();
  JobPairs pairs;
  pairs.left_out = list->left_out;
  for (const CellWork& one : list->work) pairs.cells.push_back(one.cell.Text());
  const auto add = [&](const JobProgram& with) {
    return AddCellJobs(connection, "compare", with.version, std::nullopt, list->work);
  };
  auto old_jobs = add(*other), new_jobs = add(program);
  if (!old_jobs) return old_jobs.failure();
  if (!new_jobs) return new_jobs.failure();
  pairs.old_jobs = std::move(old_jobs).value();
  pairs.new_jobs = std::move(new_jobs).value();
  return pairs;
}

Result<PlantComparison> ComparisonOf(Connection& connection, const JobPairs& pairs) {
  const auto old_answers = ReadAnswers(connection, pairs.old_jobs);
  const auto new_answers = ReadAnswers(connection, pairs.new_jobs);
  if (!old_answers) return old_answers.failure();
  if (!new_answers) return new_answers.failure();
  std::vector<CellComparison> cells;
  for (std::size_t k = 0; k < pairs.cells.size(); ++k) {
    cells.push_back(CompareAnswers(pairs.cells[k], (*old_answers)[k], (*new_answers)[k]));
  }
  return CompareCells(std::move(cells));
}

int Compare(const CompareOptions& options) {
  auto connection = OpenDatabase(options.database);
  if (!connection) return kExitFault;
  const auto program = IdentifyProgram(options.program);
  if (!program) return FailCommand(program.error());
  auto pairs = options.against == kStored ? PairsWithStored(*connection, options, *program)
                                          : PairsWithProgram(*connection, options, *program);
  if (!pairs) return FailCommand(pairs.error());
  PrintLeftOut(pairs->left_out);
  if (pairs->cells.empty()) {
    return FailCommand(
        "there is nothing to compare with: no cell has a stored diagnosis by another version. Give "
        "--against PATH, or run `plumbline plant schedule` and a worker with the old version "
        "first");
  }
  std::vector<std::int64_t> jobs = pairs->new_jobs;
  if (options.against != kStored)
    jobs.insert(jobs.end(), pairs->old_jobs.begin(), pairs->old_jobs.end());
  if (options.no_wait) {
    std::cout << fmt::format("{} jobs queued for version {}\n", jobs.size(), program->version);
    return kExitOk;
  }
  if (const auto ended = AwaitJobs(*connection, jobs, "diagnoses"); !ended)
    return FailCommand(ended.error());
  const auto comparison = ComparisonOf(*connection, *pairs);
  if (!comparison) return FailCommand(comparison.error());
  std::cout << ComparisonText(*comparison);
  if (!options.json.empty()) {
    const std::string text = text::JsonText(ComparisonJson(*comparison), 1) + '\n';
    if (!WriteCommandOutput(options.json, text, "--json")) return kExitUsage;
  }
  return comparison->IsWorse() ? kExitFault : kExitOk;
}

}  // namespace

void AddCompareCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CompareOptions>();
  CLI::App* const command = app.add_subcommand(
      "compare", "Diagnose every cell's stored rows by a new version before it is rolled out");
  AddDatabaseOptions(*command, options->database);
  command->add_option("--program", options->program, "The new program `plumbline`")->required();
  command
      ->add_option("--against", options->against,
                   "The old program, or `stored`: the newest stored diagnosis of each cell")
      ->capture_default_str();
  command->add_option("--cells", options->selection.cells, "Only these, LINE/NODE; default: all");
  command->add_option("--last", options->selection.last, "Rows of a cell at most, with a program")
      ->capture_default_str()
      ->check(CLI::Range(std::int64_t{kMinRows}, std::int64_t{100'000}));
  command->add_option("--json", options->json, "Write the comparison as JSON");
  command->add_flag("--no-wait", options->no_wait,
                    "Only queue the jobs; the same command prints their results later");
  command->footer(
      "Workers that have the version do the jobs: `plumbline plant worker --program NEW`. Both\n"
      "versions diagnose the same rows. Compared is the error of held-out rows. A cell is clearly\n"
      "worse if it grew by more than 5 % and by more than 1.96 standard deviations of the\n"
      "difference, taken from the 95 % intervals of both errors; or if the new version gives no\n"
      "answer where the old one did. The plant is worse if a cell is, or if the geometric mean of\n"
      "new / old over all cells is above 1.01 and its 95 % interval above 1.\n\n"
      "Example:\n"
      "  plumbline plant compare --program /opt/new/bin/plumbline \\\n"
      "    --against /usr/bin/plumbline\n\n"
      "Exit codes: 0 not worse; 1 worse, or the comparison could not be made; 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Compare(*options); });
}

}  // namespace plumbline::plant
