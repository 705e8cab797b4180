// plumbline registers: the register map as a document.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline {

void AddRegistersCommand(CLI::App& app, int& exit_code);

/// config/register-map.md, written from the table that drives the server.
std::string RegisterMapMarkdown();

}  // namespace plumbline
