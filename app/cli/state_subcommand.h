// Subcommands that work on the daemon's state directory: `journal`, `lens` and `model`.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "app/cli/daemon_option.h"

namespace plumbline::cli {

/// Adds a subcommand with --config, --state and this footer, which sets `exit_code` to the result
/// of `run`.
/// @param options  with a member `state`, the default of --state, and perhaps `config`
template <typename Options>
CLI::App* AddStateSubcommand(CLI::App& parent, const char* name, const char* what,
                             const std::shared_ptr<Options>& options, int (*run)(const Options&),
                             const char* footer, int& exit_code) {
  CLI::App* command = parent.add_subcommand(name, what);
  CLI::Option* state =
      command->add_option("--state", options->state, "The daemon's state_directory")
          ->capture_default_str();
  command->add_option_function<std::string>(
      "--config",
      [options, state](const std::string& path) {
        if constexpr (requires { options->config; }) options->config = path;
        if (state->count() == 0) options->state = PlaceOfDaemon(path, "--state").state_directory;
      },
      kDaemonOptionText);
  command->footer(footer);
  command->callback([options, run, &exit_code] { exit_code = run(*options); });
  return command;
}

}  // namespace plumbline::cli
