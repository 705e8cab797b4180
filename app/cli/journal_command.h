// plumbline journal: measured points in, out and on the screen.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddJournalCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
