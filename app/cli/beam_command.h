// plumbline beam: the deflection of a tool as a beam, for a series of loads.
#pragma once

#include <CLI/CLI.hpp>

namespace plumbline {

void AddBeamCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
