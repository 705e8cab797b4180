// plumbline predict: predicts the position of the loaded tip at each pose of a file.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddPredictCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
