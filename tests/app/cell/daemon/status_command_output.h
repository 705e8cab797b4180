// Output of `plumbline status` for a running daemon.
#pragma once

#include <cstdio>
#include <string>

namespace plumbline::test {

/// @param plc  the daemon's address, 127.0.0.1:1502
inline std::string StatusText(const std::string& plc) {
  const std::string command =
      std::string(PLUMBLINE) + " status --port " + plc.substr(plc.find(':') + 1) + " 2>&1";
  std::string text;
  FILE* const pipe = popen(command.c_str(), "r");
  char line[256];
  while (fgets(line, sizeof line, pipe) != nullptr) text += line;
  pclose(pipe);
  return text;
}

}  // namespace plumbline::test
