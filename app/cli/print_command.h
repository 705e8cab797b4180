// plumbline print: tags and calibration boards to scale, as PDF or SVG.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddPrintCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
