// plumbline settings: prints every key of plumbline.toml as a file, a table or a manual page.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddSettingsCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
