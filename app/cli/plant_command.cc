// plumbline plant: questions to the database of many cells, answered by plumbline-plant.
#include <CLI/CLI.hpp>
#include <algorithm>

#include "app/cli/commands.h"
#include "app/cli/exec_sibling.h"

namespace plumbline::cli {

void AddPlantCommand(CLI::App& app, int& exit_code) {
  CLI::App* const command =
      app.add_subcommand("plant", "Many cells: their database, reports and shared knowledge");
  // All that follows is plumbline-plant's, its --help too.
  command->set_help_flag();
  command->prefix_command();
  command->callback([command, &exit_code] {
    exit_code = ExecSibling("plumbline-plant", "plant", command->remaining());
  });
}

}  // namespace plumbline::cli
