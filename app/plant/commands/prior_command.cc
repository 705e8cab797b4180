#include <fmt/format.h>

#include <iostream>

#include "app/base/text/json_text.h"
#include "app/base/text/signed_text.h"
#include "app/base/text/text.h"
#include "app/plant/commands/job_progress.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/cell_work.h"
#include "app/plant/jobs/job_run.h"
#include "drivers/files/package_paths.h"
#include "drivers/files/text_file.h"
#include "drivers/os/run_program.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;

struct PriorOptions {
  DatabaseOptions database;
  std::string model, key, output, program;
  WorkSelection selection;
};

/// One arm of the model: what a job answered for it, without what the queue added.
struct PriorArm {
  CellName cell;
  json input, output;
};

/// The prior in the making: arms that are left, and the folder with their files.
struct PriorRun {
  const PriorOptions& options;
  Connection& connection;
  JobFolder folder;
  std::vector<PriorArm> arms;
  std::vector<std::int64_t> jobs;  ///< of `arms`
};

/// Runs `plumbline prior ...` and passes on what it prints.
Result<void> RunPrior(const PriorRun& run, std::vector<std::string> arguments) {
  const std::string step = arguments.front();
  arguments.insert(arguments.begin(), {run.options.program, "prior"});
  const auto done = os::RunProgram(arguments, "");
  if (!done) return Error{fmt::format("{}: {}", run.options.program, done.error())};
  if (!done->end.ok()) {
    return Error{fmt::format("plumbline prior {} failed: {}", step, text::Visible(done->errors))};
  }
  std::cerr << done->errors;
  return {};
}

/// Waits for the jobs of `work`; keeps the arms that have an answer, and names the others.
Result<void> DoStage(PriorRun& run, const std::vector<CellWork>& work, const char* what) {
  auto jobs = AddCellJobs(run.connection, "prior", "", run.options.model, work);
  if (!jobs) return jobs.failure();
  if (const auto ended = AwaitJobs(run.connection, *jobs, what); !ended) return ended;
  const auto answers = ReadAnswers(run.connection, *jobs);
  if (!answers) return answers.failure();
  run.arms.clear();
  run.jobs.clear();
  std::vector<std::string> left_out;
  for (std::size_t k = 0; k < work.size(); ++k) {
    json output = (*answers)[k].output;
    const bool refused = output.is_object() && output.contains("refused");
    if (!output.is_object() || refused) {
      left_out.push_back(fmt::format(
          "{}: {}", work[k].cell.Text(),
          refused ? text::JsonText(output["refused"]) : "job failed: " + (*answers)[k].failed));
      continue;
    }
    output.erase("plant");
    run.arms.push_back({work[k].cell, work[k].input, std::move(output)});
    run.jobs.push_back((*jobs)[k]);
  }
  PrintLeftOut(left_out);
  if (run.arms.size() >= 2) return {};
  return Error{"fewer than two arms can be used: there is nothing to pool"};
}

/// Writes a file for each arm. @return  their paths
Result<std::vector<std::string>> WriteArms(const PriorRun& run, const char* stage) {
  std::vector<std::string> files;
  for (const PriorArm& arm : run.arms) {
    files.push_back(run.folder.File(fmt::format("{}-{}.json", stage, arm.cell.cell)));
    const auto written = files::WriteTextFile(files.back(), text::JsonText(arm.output));
    if (!written) return Error{fmt::format("{}: {}", files.back(), written.error())};
  }
  return files;
}

/// `plumbline prior STEP MODEL ARM... TAIL...`
Result<void> RunOverArms(const PriorRun& run, const char* step,
                         const std::vector<std::string>& tail) {
  const auto files = WriteArms(run, step);
  if (!files) return files.failure();
  std::vector<std::string> arguments = {step, run.options.model};
  arguments.insert(arguments.end(), files->begin(), files->end());
  arguments.insert(arguments.end(), tail.begin(), tail.end());
  return RunPrior(run, std::move(arguments));
}

Result<void> FitArms(PriorRun& run) {
  const std::string sizes_file = run.folder.File("sizes.json");
  if (const auto agreed = RunOverArms(run, "sizes", {"--out", sizes_file}); !agreed) return agreed;
  const auto text = files::ReadFileUpTo(files::kTableSize, sizes_file);
  if (!text) return Error{fmt::format("{}: {}", sizes_file, text.error())};
  const auto sizes = text::JsonFromText(*text);
  if (!sizes) return Error{fmt::format("the agreed sizes: {}", sizes.error())};
  std::vector<CellWork> work;
  for (std::size_t k = 0; k < run.arms.size(); ++k) {
    json input = run.arms[k].input;
    input["stage"] = kFitStage;
    input["arm_job"] = run.jobs[k];
    input["sizes"] = *sizes;
    work.push_back({run.arms[k].cell, std::move(input)});
  }
  return DoStage(run, work, "fits");
}

/// Pools the fitted arms, signs the prior and stores it.
/// @return  number of arms in it; prints those that it leaves out
Result<int> PoolArms(PriorRun& run) {
  const std::string pooled = run.folder.File("prior.json"), signed_file = run.folder.File("signed");
  const std::string date = text::TextOfUtcNow().substr(0, 10);
  auto done = RunOverArms(run, "pool", {"--date", date, "--out", pooled});
  if (done) done = RunPrior(run, {"sign", pooled, "--key", run.options.key, "--out", signed_file});
  if (!done) return done.failure();
  const auto text = files::ReadFileUpTo(files::kTableSize, signed_file);
  if (!text) return Error{fmt::format("{}: {}", signed_file, text.error())};
  const auto plain = files::ReadFileUpTo(files::kTableSize, pooled);
  if (!plain) return Error{fmt::format("{}: {}", pooled, plain.error())};
  const auto prior = text::JsonFromText(*plain);
  if (!prior || !prior->contains("arms") || !prior->contains("left_out")) {
    return Error{"the pooled prior does not name its arms; is the program of this version?"};
  }
  const int arms = static_cast<int>(prior->at("arms").size());
  for (const json& one : prior->at("left_out")) {
    std::cerr << fmt::format("left out: {}: {}\n", one.at("arm").get<std::string>(),
                             one.at("reason").get<std::string>());
  }
  const auto stored =
      run.connection.Run("INSERT INTO prior (arm_model, arms, file) VALUES ($1, $2, $3)",
                         {run.options.model, arms, *text});
  if (!stored) return stored.failure();
  const auto written = files::WriteTextFile(run.options.output, *text);
  if (!written) return Error{fmt::format("{}: {}", run.options.output, written.error())};
  return arms;
}

int Prior(const PriorOptions& options) {
  const auto key = files::ReadTextFile(options.key);
  if (!key) return FailCommand(fmt::format("{}: {}", options.key, key.error()));
  if (const auto usable = text::SignedText("", *key); !usable)
    return FailCommand(fmt::format("{}: {}", options.key, usable.error()));
  const auto writable = files::CheckWritable(options.output);
  if (!writable) {
    std::cerr << fmt::format("{}: cannot be written: {}; choose another --output\n", options.output,
                             writable.error());
    return kExitUsage;
  }
  auto connection = OpenDatabase(options.database);
  if (!connection) return kExitFault;
  auto list = FindWork(*connection, options.selection);
  if (!list) return FailCommand(list.error());
  PrintLeftOut(list->left_out);
  if (list->work.size() < 2) {
    return FailCommand(fmt::format(
        "fewer than two cells with the arm {} have enough rows: there is nothing to pool. "
        "`plumbline plant status` lists the cells; the model is [robot] model of cell.toml",
        options.model));
  }
  for (CellWork& one : list.value().work) one.input["stage"] = kArmStage;
  auto folder = JobFolder::Create();
  if (!folder) return FailCommand(folder.error());
  PriorRun run{options, *connection, std::move(folder).value(), {}, {}};
  auto done = DoStage(run, list->work, "diagnoses");
  if (done) done = FitArms(run);
  if (!done) return FailCommand(done.error());
  const auto arms = PoolArms(run);
  if (!arms) return FailCommand(arms.error());
  std::cout << fmt::format(
      "{}: prior from {} arms of {}. Copy it to /etc/plumbline/priors of each "
      "cell with such an arm\n",
      options.output, *arms, options.model);
  return kExitOk;
}

}  // namespace

void AddPriorCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PriorOptions>();
  options->program = files::PlumblineProgram();
  CLI::App* const command = app.add_subcommand(
      "prior", "What the arms of one model have in common, as a signed file for their cells");
  AddDatabaseOptions(*command, options->database);
  command->add_option("model", options->model, "Arm model, as in [robot] model of the cells")
      ->required();
  command->add_option("--key", options->key, "Private key of the plant, PEM, Ed25519")->required();
  command->add_option("--output", options->output, "Write the signed prior to this file")
      ->required();
  command->add_option("--program", options->program, "Program `plumbline` that pools and signs")
      ->default_str("the one beside this program");
  command->add_option("--last", options->selection.last, "Rows of a cell at most, the newest")
      ->capture_default_str()
      ->check(CLI::Range(std::int64_t{kMinRows}, std::int64_t{100'000}));
  command->footer(
      "Workers diagnose the arms and fit what they share; the same command after an interruption,\n"
      "or with a few new cells, only does what is missing. Cells with too few rows, or whose arm\n"
      "cannot be used, are left out and named.\n\n"
      "Example:\n"
      "  openssl genpkey -algorithm ed25519 -out plant.key\n"
      "  plumbline plant prior \"KR 210 R2700-2\" --key plant.key --output kr210.prior\n\n"
      "Exit codes: 0 written; 1 no prior, or no database; 2 wrong arguments, or the file cannot "
      "be\n"
      "written.");
  command->callback([options, &exit_code] {
    options->selection.arm_model = options->model;
    options->selection.any_model = true;
    exit_code = Prior(*options);
  });
}

}  // namespace plumbline::plant
