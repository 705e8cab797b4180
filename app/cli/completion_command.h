// plumbline completion: bash completion script, generated for the package.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddCompletionCommand(CLI::App& app, int& exit_code);

/// A bash script that completes commands, options and enumerated option values; everything else is
/// completed as a file name. Generated from the parser, so that it matches the options exactly.
std::string BashCompletion(const CLI::App& app);

}  // namespace plumbline::cli
