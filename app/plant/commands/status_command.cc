#include <fmt/format.h>

#include <iostream>

#include "app/base/terminal/terminal_output.h"
#include "app/plant/answers/status_text.h"
#include "app/plant/commands/plant_commands.h"

namespace plumbline::plant {
namespace {

struct StatusOptions : DatabaseOptions {
  bool json = false;
};

int Status(const StatusOptions& options) {
  auto connection = OpenDatabase(options);
  if (!connection) return kExitFault;
  const auto plant = ReadPlantState(*connection);
  if (!plant) {
    std::cerr << fmt::format(
        "the plant's database did not answer: {}. Check that its user has the role "
        "plumbline_reader\n",
        plant.error());
    return kExitFault;
  }
  if (options.json) {
    std::cout << StatusJson(*plant);
  } else {
    std::cout << terminal::ForReading << StatusText(*plant);
  }
  return NeedsPerson(*plant) ? kExitFault : kExitOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusOptions>();
  CLI::App* const command =
      app.add_subcommand("status", "Show every cell's last word, and what is missing or refused");
  AddDatabaseOptions(*command, *options);
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "Cells that need a person come first. Needs the role plumbline_reader.\n\n"
      "Example:\n"
      "  plumbline plant status --database \"host=db1 dbname=plumbline user=reader\"\n\n"
      "Exit codes: 0 nothing needs a person; 1 something does, or the database does\n"
      "not answer; 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Status(*options); });
}

}  // namespace plumbline::plant
