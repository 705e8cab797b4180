// plumbline beam: deflection and stress of a beam-shaped tool for a series of loads.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddBeamCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
