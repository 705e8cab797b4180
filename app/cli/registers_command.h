// Command `plumbline registers`: prints the register map as a document.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddRegistersCommand(CLI::App& app, int& exit_code);

/// Text of config/register-map.md, generated from the table that drives the server.
std::string RegisterMapMarkdown();

}  // namespace plumbline::cli
