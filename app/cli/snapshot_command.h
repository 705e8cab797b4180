// plumbline snapshot: saves one picture of what the display shows.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddSnapshotCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
