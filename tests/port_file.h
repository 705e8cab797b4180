// Port that a program has written with --port-file.
#pragma once

#include <chrono>
#include <fstream>
#include <string>
#include <thread>

namespace plumbline::test {

/// The port of this name in the file; 0 if there is none (yet).
inline int PortIn(const std::string& file, const std::string& name) {
  std::ifstream lines(file);
  std::string word;
  for (int port = 0; lines >> word >> port;) {
    if (word == name) return port;
  }
  return 0;
}

/// Waits for the port as long as `running` returns true, at most a minute. @return 0 if none came
template <typename Running>
int AwaitPort(const std::string& file, const std::string& name, Running running) {
  for (int wait = 0; wait < 6000; ++wait) {
    const bool may_come = running();  // read before the file: it may end just after writing
    if (const int port = PortIn(file, name); port > 0 || !may_come) return port;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return 0;
}

}  // namespace plumbline::test
