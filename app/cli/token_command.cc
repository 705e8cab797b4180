// `plumbline token`.
#include <CLI/CLI.hpp>
#include <iostream>

#include "app/base/config/page_token.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"

namespace plumbline::cli {

void AddTokenCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("token", "Print a random token for [page]");
  command->footer(
      "128 bits of the kernel's random numbers. Write it to plumbline.toml as token = \"...\" "
      "under "
      "[page].\n\n"
      "Example:\n  plumbline token");
  command->callback([&exit_code] {
    std::cout << config::GeneratedToken() << '\n';
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
