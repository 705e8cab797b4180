// plumbline track: tags and bodies in an image.
#pragma once

#include <CLI/CLI.hpp>

namespace plumbline {

void AddTrackCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
