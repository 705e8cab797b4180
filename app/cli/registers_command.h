// plumbline registers: prints the Modbus register map as Markdown or JSON.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline {

void AddRegistersCommand(CLI::App& app, int& exit_code);

/// The text of config/register-map.md, generated from the table that drives the server.
std::string RegisterMapMarkdown();

}  // namespace plumbline
