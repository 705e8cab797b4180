// plumbline snapshot: one picture of the monitor.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddSnapshotCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
