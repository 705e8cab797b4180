// plumbline track: poses of tags and bodies in an image or a camera stream.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddTrackCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
