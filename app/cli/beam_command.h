// plumbline beam: the deflection of a tool as a beam, for a series of loads.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline {

void AddBeamCommand(CLI::App& app, int& exit_code);

/// Forces of `100,200,300` or of a series `FIRST:STEP:LAST` (`100:100:1000`), in the unit given.
/// @return the forces, at most 10000, or what is wrong with the text
Result<std::vector<double>> ForceSeriesFromText(const std::string& text);

}  // namespace plumbline
