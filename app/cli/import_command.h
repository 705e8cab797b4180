// plumbline import: exports of instruments and robots as measured.csv.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddImportCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
