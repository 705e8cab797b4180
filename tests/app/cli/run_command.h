// A subcommand of plumbline, run in this process.
#pragma once

#include <CLI/CLI.hpp>
#include <iostream>
#include <sstream>
#include <string>

namespace plumbline::test {

struct Answer {
  int exit_code = -1;
  std::string out, err;
};

/// Runs `plumbline LINE`, where LINE begins with the subcommand that `add` adds.
inline Answer RunCommand(void (*add)(CLI::App&, int&), const std::string& line) {
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
