// Runs the real plumbline program in a shell.
#pragma once

#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <string>

namespace plumbline::test {

struct Answer {
  int exit_code = -1;
  std::string output;
};

/// Runs `plumbline ARGUMENTS` in a shell. The output is standard error, and standard output unless
/// the arguments redirect it.
inline Answer Shell(const std::string& arguments) {
  Answer answer;
  const std::string command = "exec 2>&1; " PLUMBLINE " " + arguments;
  std::FILE* const pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::array<char, 4096> buffer{};
  while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    answer.output.append(buffer.data(), count);
  }
  const int status = pclose(pipe);
  answer.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return answer;
}

}  // namespace plumbline::test
