// plumbline model: versions of the cell's model; which one is in force.
#pragma once

#include <CLI/CLI.hpp>

namespace plumbline {

void AddModelCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
