// plumbline track: tags and bodies in an image.
#pragma once

namespace CLI {
class App;
}

namespace plumbline {

void AddTrackCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline
