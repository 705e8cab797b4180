// plumbline journal: import, export, display and quarantine of measured points.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddJournalCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
