#include "tests/app/cli/run_command.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <sstream>

namespace plumbline::test {

Answer RunCommand(void (*add)(CLI::App&, int&), const std::string& line) {
  std::ostringstream out, err;
  std::streambuf* const old_out = std::cout.rdbuf(out.rdbuf());
  std::streambuf* const old_err = std::cerr.rdbuf(err.rdbuf());
  Answer answer;
  CLI::App app("", "plumbline");
  add(app, answer.exit_code);
  try {
    app.parse(line);
  } catch (const CLI::ParseError& error) {
    answer.exit_code = app.exit(error) == 0 ? 0 : 2;
  }
  std::cout.rdbuf(old_out);
  std::cerr.rdbuf(old_err);
  answer.out = out.str();
  answer.err = err.str();
  return answer;
}

}  // namespace plumbline::test
