// plumbline plan: which postures to measure first.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddPlanCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
