// plumbline completion: bash completion script, generated for the package.
#include <CLI/CLI.hpp>
#include <iostream>

#include "app/base/terminal/bash_completion.h"
#include "app/cli/commands.h"
#include "app/cli/exec_sibling.h"

namespace plumbline::cli {
namespace {

/// Hands the words after `plumbline plant` to the completion of plumbline-plant.
constexpr const char* kPlant = R"(_plumbline_with_plant() {
  if [[ $COMP_CWORD -gt 1 && ${COMP_WORDS[1]} == plant ]]; then
    COMP_WORDS=("${COMP_WORDS[@]:1}")
    ((--COMP_CWORD))
    _plumbline_plant
  else
    _plumbline
  fi
}
complete -o bashdefault -o default -F _plumbline_with_plant plumbline
)";

}  // namespace

void AddCompletionCommand(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("completion", "Completions for bash");
  command->footer("Example:\n  source <(plumbline completion)");
  command->callback([&app, &exit_code] {
    std::cout << "# bash completion for plumbline(1)\n"
              << terminal::BashCompletion(app, "plumbline") << kPlant << std::flush;
    exit_code = ExecSibling("plumbline-plant", "completion", {"completion"});
  });
}

}  // namespace plumbline::cli
