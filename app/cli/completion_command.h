// plumbline completion: what a shell completes, for the package.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline {

void AddCompletionCommand(CLI::App& app, int& exit_code);

/// A script for bash that completes commands, options and the values of options that have a list
/// of them; everything else is completed as a file's name. Made from the parser itself, so that it
/// knows every option, and no other.
std::string BashCompletion(const CLI::App& app);

}  // namespace plumbline
