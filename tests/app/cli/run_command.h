// Runs a subcommand of plumbline in the test process.
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

/// Runs `plumbline LINE`; LINE starts with the subcommand that `add` registers.
Answer RunCommand(void (*add)(CLI::App&, int&), const std::string& line);

}  // namespace plumbline::test
