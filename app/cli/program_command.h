// plumbline program, for a choice of languages.
#pragma once

#include <span>

#include "app/programs/brand.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

/// AddProgramCommand() with other brands than those of programs::Brands().
void AddProgramCommandFor(std::span<const programs::Brand* const> brands, CLI::App& app,
                          int& exit_code);

}  // namespace plumbline::cli
