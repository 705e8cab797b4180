#include "app/cli/exec_view.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>

#include "app/cli/failure.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cli {

int ExecView(const std::string& command, std::vector<std::string> arguments) {
  const std::string program = files::SiblingProgram("plumbline-view");
  arguments.insert(arguments.begin(), program);
  std::vector<char*> words;
  words.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  std::cerr << fmt::format("plumbline {}: {} cannot be started: {}; {}\n", command, program,
                           std::strerror(errno), files::kRestoreProgram);
  return kExitUsage;
}

}  // namespace plumbline::cli
