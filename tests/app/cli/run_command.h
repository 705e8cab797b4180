// A subcommand of plumbline, run in this process.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace plumbline::test {

struct Answer {
  int exit_code = -1;
  std::string out, err;
};

/// Runs `plumbline LINE`, where LINE begins with the subcommand that `add` adds.
Answer RunCommand(void (*add)(CLI::App&, int&), const std::string& line);

}  // namespace plumbline::test
