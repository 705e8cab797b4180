// plumbline beam: the deflection of a tool as a beam, for a series of loads.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddBeamCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
