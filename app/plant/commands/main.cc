// plumbline-plant: questions to the plant's database, and work over many machines. Started by
// `plumbline plant`.
#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>

#include "app/base/terminal/bash_completion.h"
#include "app/base/terminal/help_formatter.h"
#include "app/base/terminal/terminal_output.h"
#include "app/plant/commands/plant_commands.h"
#include "app/version.h"

int main(int argc, char** argv) {
  using namespace plumbline;
  std::signal(SIGPIPE, SIG_IGN);
  const terminal::TerminalOutput out(std::cout, STDOUT_FILENO), err(std::cerr, STDERR_FILENO);
  CLI::App app("Many cells: their database, reports and shared knowledge", "plumbline plant");
  app.formatter(terminal::HelpFormatter());
  app.set_version_flag("--version", kVersionAndBuild);
  app.require_subcommand(1);
  app.footer(
      "`plumbline plant COMMAND --help` shows the options of a command, with examples.\n\n"
      "Examples:\n"
      "  plumbline plant init --database dbname=plumbline\n"
      "  plumbline plant status\n"
      "  plumbline plant report --days 30 --html report.html");
  int exit_code = plant::kExitOk;
  plant::AddInitCommand(app, exit_code);
  plant::AddCellCommand(app, exit_code);
  plant::AddExportCommand(app, exit_code);
  plant::AddScheduleCommand(app, exit_code);
  plant::AddWorkerCommand(app, exit_code);
  plant::AddCompareCommand(app, exit_code);
  plant::AddPriorCommand(app, exit_code);
  plant::AddStatusCommand(app, exit_code);
  plant::AddReportCommand(app, exit_code);
  plant::AddPageCommand(app, exit_code);
  // `plumbline completion` appends what this prints.
  CLI::App* const completion = app.add_subcommand("completion", "Completions for bash")->group("");
  completion->callback([&app] { std::cout << terminal::BashCompletion(app, "plumbline-plant"); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? plant::kExitOk : plant::kExitUsage;
  }
  return exit_code;
}
