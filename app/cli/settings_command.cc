// plumbline settings: prints every key of plumbline.toml as a file, a table or a manual page.
#include <CLI/CLI.hpp>
#include <iostream>

#include "app/base/config/settings_text.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"

namespace plumbline::cli {

void AddSettingsCommand(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("settings", "Print every key of plumbline.toml with default and range");
  auto table = std::make_shared<bool>(false), page = std::make_shared<bool>(false);
  auto* markdown = command->add_flag("--markdown", *table, "Print a Markdown table");
  command->add_flag("--man", *page, "Print the manual page plumbline.toml(5)")->excludes(markdown);
  command->footer("Example:\n  plumbline settings > plumbline.toml");
  command->callback([table, page, &exit_code] {
    std::cout << (*table  ? config::SettingsMarkdown()
                  : *page ? config::SettingsManPage()
                          : config::SettingsToml());
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
