// plumbline distance: measures distances and points of the object table.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/exec_sibling.h"

namespace plumbline::cli {
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
  return ExecView("distance", words);
}

}  // namespace

void AddDistanceCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DistanceArguments>();
  CLI::App* command =
      app.add_subcommand("distance", "Measure distances and points of the overlay's objects");
  command->add_option("config", options->config, "plumbline.toml of the running daemon")
      ->required();
  command->add_option("name", options->names,
                      "Name of a [[distance]], a [[point]] or an object of a [[pair]]; default: "
                      "all");
  command->add_flag("--json", options->json, "Print JSON, with the nearest points");
  command->footer(
      "Measures in the latest state of the running daemon, with bending objects in their "
      "deflected\n"
      "shape. Points are in the measurement frame. Requires no display, no GPU and no running\n"
      "plumbline-view.\n\n"
      "Examples:\n  plumbline distance plumbline.toml\n"
      "  plumbline distance plumbline.toml \"left gap\" --json\n\n"
      "Exit codes: 0 everything requested was measured (even if objects interfere), 1 faults in "
      "the\n"
      "configuration or object table, an unknown name, or an object without a known pose, 2 wrong\n"
      "arguments or no running daemon.");
  command->callback([options, &exit_code] { exit_code = RunDistance(*options); });
}

}  // namespace plumbline::cli
