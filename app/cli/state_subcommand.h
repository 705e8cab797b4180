// Subcommands that work on the daemon's state directory: `journal`, `lens` and `model`.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace plumbline::cli {

/// Adds a subcommand with --state and this footer, which sets `exit_code` to the result of `run`.
/// @param options  with a member `state`, the default of --state
template <typename Options>
CLI::App* AddStateSubcommand(CLI::App& parent, const char* name, const char* what,
                             const std::shared_ptr<Options>& options, int (*run)(const Options&),
                             const char* footer, int& exit_code) {
  CLI::App* command = parent.add_subcommand(name, what);
  command->add_option("--state", options->state, "The daemon's state_directory")
      ->capture_default_str();
  command->footer(footer);
  command->callback([options, run, &exit_code] { exit_code = run(*options); });
  return command;
}

}  // namespace plumbline::cli
