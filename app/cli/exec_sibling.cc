#include "app/cli/exec_sibling.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>

#include "app/cli/failure.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cli {

int ExecSibling(const std::string& name, const std::string& command,
                std::vector<std::string> arguments) {
  const std::string program = files::SiblingProgram(name);
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
