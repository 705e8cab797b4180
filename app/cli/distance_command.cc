#include "app/cli/distance_command.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/become_view.h"

namespace plumbline {
namespace {

struct DistanceArguments {
  std::string config;
  std::vector<std::string> names;
  bool json = false;
};

int RunDistance(const DistanceArguments& options) {
  std::vector<std::string> words = {options.config, "--distances"};
  for (const std::string& name : options.names) words.push_back("--name=" + name);
  if (options.json) words.emplace_back("--json");
  return BecomeView("distance", words);
}

}  // namespace

void AddDistanceCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DistanceArguments>();
  CLI::App* command =
      app.add_subcommand("distance", "Distances and points of the overlay's objects, by name");
  command->add_option("config", options->config, "The running daemon's plumbline.toml")->required();
  command->add_option("name", options->names,
                      "Of a [[distance]], a [[point]] or an object of a [[pair]]; default all");
  command->add_flag("--json", options->json, "Answer as JSON, with the nearest points");
  command->footer(
      "Measured in the running daemon's newest state, of what bends in its bent state; points are "
      "in\n"
      "the measurement frame. Needs no screen, no GPU and no plumbline-view that runs.\n\n"
      "Examples:\n  plumbline distance plumbline.toml\n"
      "  plumbline distance plumbline.toml \"left gap\" --json\n\n"
      "Exit codes: 0 all that was asked for is measured (interference too), 1 faults in "
      "configuration\n"
      "or table, a name that is not there, or something is not in place, 2 wrong arguments or no\n"
      "daemon.");
  command->callback([options, &exit_code] { exit_code = RunDistance(*options); });
}

}  // namespace plumbline
